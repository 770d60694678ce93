"""Plot of a deformed body: axes, outline at rest, and stress."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]

_LEAST_INCHES, _MOST_INCHES = 5.0, 9.0
_TITLE_INCHES, _BESIDE_INCHES = 1.2, 1.8
"""Height needed by title and axis labels, and width needed by axis labels and colour bar, in inches."""
_LEAST_WIDE_INCHES = 7.5
"""Smallest width in inches, which a title of two lines needs."""
_ON_AXIS = 1e-9
"""Tolerance relative to the size of the body: edges that are nearer to the symmetry axis lie on the axis."""
_COLOURS = "YlOrRd"
"""Colour map that is pale at zero stress, so that the shape of the body remains visible."""


def framed(low: Array, high: Array) -> tuple[Figure, Axes]:
    """Make a figure with the proportions of its content.

    Parameters
    ----------
    low, high : ndarray of float, shape (2,)
        Lower left and upper right corner of the content's bounding box, in mm.
    """
    wide, tall = (high - low).tolist()
    scale = min((_MOST_INCHES - _BESIDE_INCHES) / wide, (_MOST_INCHES - _TITLE_INCHES) / tall)
    size = (max(scale * wide + _BESIDE_INCHES, _LEAST_WIDE_INCHES), max(scale * tall + _TITLE_INCHES, _LEAST_INCHES))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    return figure, axes


def draw_body(
    axes: Axes, plate: PlaneStressPlate, moved: Array, stress: Array, top_mpa: float, *, side: float | None = None
) -> Any:
    """Draw a body's outline at rest and its deformed shape coloured by stress; return the data for a colour bar.

    Parameters
    ----------
    axes : Axes
        Axes to draw on.
    plate : PlaneStressPlate
        The meshed body.
    moved : ndarray of float, shape (unknowns,)
        Displacements in mm, drawn to scale.
    stress : ndarray of float, shape (corners,)
        Von Mises stress at the corners, in MPa.
    top_mpa : float
        Stress at the upper end of the colour scale.
    side : float or None
        For a body that is symmetric about the y axis and of which only the right half is meshed: 1 draws the right
        half, and -1 its mirror image; the y axis, along which the halves join, is not drawn as an edge. None for a
        complete body.
    """
    x, y = plate.nodes_mm
    u, v = moved[plate.x_dofs], moved[plate.y_dofs]
    ends = plate.outline_edges[[0, 2, 1]]
    if side is not None:
        ends = ends[:, np.abs(x[ends]).max(axis=0) > _ON_AXIS * np.ptp(plate.nodes_mm)]
    side = side or 1.0
    count = stress.size
    at_rest, there = (np.stack([side * a[ends], b[ends]]).T for a, b in ((x, y), (x + u, y + v)))
    # All edges are one collection: a separate line for each edge would take longer than the finite elements.
    axes.add_collection(LineCollection(list(at_rest), colors="0.6", linewidths=0.6, zorder=1))
    shape = Triangulation(side * (x + u)[:count], (y + v)[:count], np.asarray(plate.corner_triangles).T)
    colours = axes.tripcolor(shape, stress, shading="gouraud", cmap=_COLOURS, vmin=0.0, vmax=top_mpa, zorder=2)
    axes.add_collection(LineCollection(list(there), colors="0.2", linewidths=0.6, zorder=3))
    axes.autoscale_view()
    return colours


def extent_mm(plate: PlaneStressPlate, moved: Array, *, mirrored: bool = False) -> tuple[Array, Array]:
    """Bounding box that contains a body both at rest and deformed, in mm."""
    at_rest = plate.nodes_mm
    there = at_rest + np.stack([moved[plate.x_dofs], moved[plate.y_dofs]])
    both = np.hstack([at_rest, there])
    if mirrored:
        both = np.hstack([both, both * np.array([[-1.0], [1.0]])])
    return both.min(axis=1), both.max(axis=1)
