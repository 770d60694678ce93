"""Find the element of a mesh in which a point lies, so that the point moves with this element.

A fit through the nearest nodes would mix the motions of two bodies on both sides of a narrow gap.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_NEWTON = 5
"""Newton steps on elements with a curved edge; each step squares the relative residual."""


def element_weights(nodes_mm: Array, triangles: Indices, point: tuple[float, float]) -> tuple[Indices, Array]:
    """Find the element that contains a point, or the nearest element, and the values of its shape functions there.

    Parameters
    ----------
    nodes_mm : ndarray of float, shape (2, n)
        Nodes.
    triangles : ndarray of int, shape (6, m)
        Corners, then the middles of edges first to second, second to third, first to third.
    point : (float, float)
        A point inside the body, or on its outline.

    Returns
    -------
    nodes : ndarray of int, shape (6,)
        Nodes of the element.
    weights : ndarray of float, shape (6,)
        Weights of the values at these nodes; their sum is 1.
    """
    a, b, c = (nodes_mm[:, row] for row in triangles[:3])
    p = np.array(point, dtype=np.float64)[:, None]
    area = _cross(b - a, c - a)
    # Distances outside the three edges: barycentric coordinates times heights.
    outside = np.max(
        [-_cross(q - p, r - p) * np.sign(area) / np.hypot(*(r - q)) for q, r in ((b, c), (c, a), (a, b))], axis=0
    )
    place = int(np.argmin(outside))
    own = triangles[:, place]
    at = np.array([_cross(p[:, 0] - a[:, place], (c - a)[:, place]), _cross((b - a)[:, place], p[:, 0] - a[:, place])])
    at = at / area[place]
    for _ in range(_NEWTON):
        values, slopes = _shapes(at)
        at = at + np.linalg.solve(nodes_mm[:, own] @ slopes, p[:, 0] - nodes_mm[:, own] @ values)
    return np.asarray(own), _shapes(at)[0]


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def _shapes(at: Array) -> tuple[Array, Array]:
    """Quadratic shape functions, shape (6,), and their derivatives, shape (6, 2), at barycentric (1 - s - t, s, t)."""
    s, t = at
    r = 1.0 - s - t
    values = np.array([r * (2 * r - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * r * s, 4 * s * t, 4 * r * t])
    by_s = [1 - 4 * r, 4 * s - 1, 0.0, 4 * (r - s), 4 * t, -4 * t]
    by_t = [1 - 4 * r, 0.0, 4 * t - 1, -4 * s, 4 * s, 4 * (r - t)]
    return values, np.array([by_s, by_t]).T
