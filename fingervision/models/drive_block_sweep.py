"""Compliance of the drive block over a range of drawings: computed for a few drawings, interpolated between them.

Meshing the block takes longer than computing the rest of a lumped model, and the block's compliance hardly changes from
one drawing of a grid to the next. Along every dimension that changes the block's compliance, the compliance is computed
at Chebyshev points and interpolated by a polynomial.
"""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper
from fingervision.models.drive_block_root import block_shape, unit_compliance

Array = NDArray[np.float64]

_NODES = 5
"""Chebyshev points per dimension: the interpolated compliance is then within 1 % of the computed one for a change of a
link's length by a third."""
_TOLERANCE = 0.03
"""Largest error of the interpolation at the test points, as a share of the largest entry; the finite size of the
block's mesh alone causes 2 % (`drive_block_root`)."""
_TRIED = 3
_SAME = 1e-9

Blocks = Callable[[Sequence[float]], Array | None]


def block_compliances(drawn: Callable[[Sequence[float]], Gripper], axes: Sequence[Sequence[float]]) -> Blocks:
    """Compute the unit compliances of the drive blocks for a grid of drawings.

    Parameters
    ----------
    drawn : callable
        Maps values of the varied dimensions to the drawing that has them.
    axes : sequence of sequence of float
        Values that each varied dimension takes.

    Returns
    -------
    callable
        Maps values to the unit compliance, shape (3, 3). It returns None if the compliance must be computed for each
        drawing separately, because the grid is too small for an interpolation or the compliance changes too abruptly.
    """
    changing = [place for place in range(len(axes)) if _changes(drawn, axes, place)]
    if not changing or int(np.prod([len(axes[place]) for place in changing])) <= 2 * _NODES ** len(changing):
        return lambda _: None
    first = [float(values[0]) for values in axes]
    spans = [(float(min(axes[place])), float(max(axes[place]))) for place in changing]
    unit = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    nodes = [0.5 * (a + b) + 0.5 * (b - a) * unit for a, b in spans]

    def at(values: Sequence[float]) -> Array:
        whole = list(first)
        for place, value in zip(changing, values, strict=True):
            whole[place] = value
        return unit_compliance(block_shape(drawn(whole)))

    try:
        table = np.array([at(values) for values in product(*(row.tolist() for row in nodes))])
    except FingervisionError:
        return lambda _: None
    table = table.reshape(*(_NODES for _ in changing), 3, 3)

    def interpolated(values: Sequence[float]) -> Array:
        found = table
        for place, row in zip(changing, nodes, strict=True):
            found = np.tensordot(_lagrange(row, float(values[place])), found, axes=1)
        return np.asarray(found)

    for share in np.linspace(0.1, 0.8, _TRIED).tolist():
        tried = [a + share * (b - a) for a, b in spans]
        whole = list(first)
        for place, value in zip(changing, tried, strict=True):
            whole[place] = value
        own = at(tried)
        if np.abs(interpolated(whole) - own).max() > _TOLERANCE * np.abs(own).max():
            return lambda _: None
    return interpolated


def _changes(drawn: Callable[[Sequence[float]], Gripper], axes: Sequence[Sequence[float]], place: int) -> bool:
    """Whether varying a dimension over its range changes the block's shape."""
    values = [float(row[0]) for row in axes]
    shapes = []
    for value in (min(axes[place]), float(np.mean(axes[place])), max(axes[place])):
        values[place] = value
        shapes.append(block_shape(drawn(values)).numbers)
    return not np.allclose(shapes, shapes[0], rtol=0.0, atol=_SAME)


def _lagrange(nodes: Array, at: float) -> Array:
    """Lagrange weights by which values at the nodes are summed to the interpolating polynomial's value at a point."""
    apart = nodes[:, None] - nodes[None, :] + np.eye(nodes.size)
    way = np.where(np.eye(nodes.size, dtype=bool), 1.0, at - nodes[None, :])
    return np.asarray(np.prod(way / apart, axis=1))
