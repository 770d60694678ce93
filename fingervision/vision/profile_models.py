"""What the mean profile across a flank may be, and the least-squares fit of each.

A finger's edge is a step of light that the optics spread. Beside it there may be a second step (the side wall of a
thick part, between the finger's face and the ground), a ramp (a soft shadow on the ground) or a bright line (glare
along the edge, on the finger). Each of them draws a single step that is fitted towards itself.
"""

from math import erf, exp, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled

Floats = NDArray[np.float64]

# What the profile is made of beside the step.
STEP, WALL, SHADOW, GLARE = range(4)
# Where the search for the breadth of each begins (pixels), and the limits within which it stays.
STARTS_PX = ((0.0,), (1.5, 3.0, 5.0), (4.0, 8.0, 14.0), (1.0, 2.5, 4.5))
LIMITS_PX = ((0.0, 0.0), (0.8, 10.0), (2.0, 24.0), (0.5, 8.0))
# Sharpening, and the tails of real optics, add an odd part: a step of this many times the blur less the step itself.
TAIL_BLURS = 2.2
# Blur of the optics, the pixel included, stays within these limits (pixels).
LEAST_BLUR_PX, LARGEST_BLUR_PX = 0.3, 5.0
# The edge is looked for so far from where the single step was found (pixels).
FARTHEST_PX = 7.0
# Level, contrast, tail, addition; position, blur and breadth.
LINEAR, PARAMETERS = 4, 7
POSITION, BLUR, BREADTH = 4, 5, 6
ITERATIONS, SETTLED = 40, 1e-7
# Blur as the picture's other edges tell it (standard uncertainty, relative).
U_BLUR = 0.1


class ProfileFit(NamedTuple):
    """One model of a profile.

    Parameters
    ----------
    squares : float
        Weighted sum of the squared residuals.
    position : float
        The finger's edge, outwards from where the single step lies (pixels).
    u_position : float
        Its standard uncertainty for unit variance of the weighted residuals.
    breadth : float
        Of the wall or shadow, or how far inside the glare lies (pixels).
    share : float
        Size of the addition, as a share of the contrast of finger and ground.
    blur : float
        Standard deviation of the optics' spread, the pixel included (pixels).
    """

    squares: float
    position: float
    u_position: float
    breadth: float
    share: float
    blur: float


@compiled
def _phi(z: float) -> float:
    return exp(-0.5 * z * z) / sqrt(2.0 * np.pi)


@compiled
def _cumulative(z: float) -> float:
    return 0.5 + 0.5 * erf(z * sqrt(0.5))


@compiled
def addition(kind: int, t: float, blur: float, breadth: float) -> float:
    """The part beside the step, blurred, at a distance from the edge outwards."""
    if kind == WALL:  # what lies between the first step and the second
        return _cumulative(t / blur) - _cumulative((t - breadth) / blur)
    if kind == SHADOW:  # falls from one at the edge to nothing at its breadth
        a, b = t / blur, (t - breadth) / blur
        ramp = (1.0 - t / breadth) * (_cumulative(a) - _cumulative(b))
        return ramp + blur / breadth * (_phi(b) - _phi(a))
    if kind == GLARE:
        return _phi((t + breadth) / blur)
    return 0.0


@compiled
def _row(kind: int, t: float, p: Floats, out: Floats) -> None:
    """Level, step, tail and addition at one place."""
    away, blur = t - p[POSITION], p[BLUR]
    step = _cumulative(away / blur)
    out[0], out[1] = 1.0, step
    out[2] = _cumulative(away / (TAIL_BLURS * blur)) - step
    out[3] = addition(kind, away, blur, p[BREADTH])


@compiled
def _squares(kind: int, t: Floats, value: Floats, weight: Floats, p: Floats) -> float:
    """Weighted squares with the linear parameters at their best; these are put into `p`."""
    count = LINEAR if kind != STEP else LINEAR - 1
    normal, right, row = np.zeros((count, count)), np.zeros(count), np.empty(LINEAR)
    for i in range(t.size):
        _row(kind, t[i], p, row)
        for a in range(count):
            right[a] += weight[i] * row[a] * value[i]
            for b in range(count):
                normal[a, b] += weight[i] * row[a] * row[b]
    for a in range(count):
        normal[a, a] *= 1.0 + 1e-9
    # The tail is small: a weak pull to nothing keeps it from standing in for a wall.
    normal[2, 2] += 0.05 * normal[1, 1]
    solved = np.linalg.solve(normal, right)
    p[:LINEAR] = 0.0
    p[:count] = solved
    total = 0.0
    for i in range(t.size):
        _row(kind, t[i], p, row)
        model = 0.0
        for a in range(count):
            model += p[a] * row[a]
        total += weight[i] * (value[i] - model) ** 2
    return total


@compiled
def fit_profile(
    kind: int, t: Floats, value: Floats, weight: Floats, blur: float, start: float, is_blur_known: bool = False
) -> ProfileFit:
    """Fit one model to a mean profile (Levenberg and Marquardt over position, blur and breadth).

    Parameters
    ----------
    kind : int
        STEP, WALL, SHADOW or GLARE.
    t : ndarray of float, shape (n,)
        Places, outwards from the single step's edge (pixels).
    value, weight : ndarray of float, shape (n,)
        Light there, and the inverse of its variance.
    blur, start : float
        First guess of the blur and of the breadth (pixels).
    is_blur_known : bool
        Whether the blur is that of the guess.
    """
    limits = LIMITS_PX[kind]
    free = 3 if kind != STEP else 2
    p = np.zeros(PARAMETERS)
    p[BLUR], p[BREADTH] = blur, start
    if kind == WALL:
        p[POSITION] = -0.5 * start
    best = _squares(kind, t, value, weight, p)
    damping = 1e-2
    normal, right = np.zeros((free, free)), np.zeros(free)
    for _iteration in range(ITERATIONS):
        base = _model(kind, t, p)
        jacobian = np.empty((free, t.size))
        for a in range(free):
            moved = p.copy()
            moved[POSITION + a] += 1e-4
            _squares(kind, t, value, weight, moved)
            other = _model(kind, t, moved)
            for i in range(t.size):
                jacobian[a, i] = (other[i] - base[i]) / 1e-4
        for a in range(free):
            right[a] = 0.0
            for i in range(t.size):
                right[a] += weight[i] * jacobian[a, i] * (value[i] - base[i])
            for b in range(free):
                normal[a, b] = 0.0
                for i in range(t.size):
                    normal[a, b] += weight[i] * jacobian[a, i] * jacobian[b, i]
        if is_blur_known:
            normal[1, :], normal[:, 1], normal[1, 1], right[1] = 0.0, 0.0, 1.0, 0.0
        has_moved = False
        for _try in range(6):
            damped = normal.copy()
            for a in range(free):
                damped[a, a] = normal[a, a] * (1.0 + damping) + 1e-12
            move = np.linalg.solve(damped, right)
            new = p.copy()
            for a in range(free):
                new[POSITION + a] += min(max(move[a], -1.0), 1.0)
            new[POSITION] = min(max(new[POSITION], -FARTHEST_PX), FARTHEST_PX)
            new[BLUR] = min(max(new[BLUR], LEAST_BLUR_PX), LARGEST_BLUR_PX)
            if free == 3:
                new[BREADTH] = min(max(new[BREADTH], limits[0]), limits[1])
            squares = _squares(kind, t, value, weight, new)
            if squares < best:
                has_moved = best - squares > SETTLED * best
                best, p, damping = squares, new, max(0.3 * damping, 1e-6)
                break
            damping *= 4.0
        if not has_moved:
            break
    # The blur alone hardly shows in one profile: the other edges of the picture tell it to a part.
    normal[1, 1] += 1.0 / (U_BLUR * p[BLUR]) ** 2
    for a in range(free):
        normal[a, a] = normal[a, a] * (1.0 + 1e-9) + 1e-12
    variance = np.linalg.inv(normal)[0, 0]
    contrast = p[1] if abs(p[1]) > 1e-9 else 1e-9
    share = p[3] / contrast
    if kind == GLARE:
        share /= p[BLUR] * sqrt(2.0 * np.pi)
    return ProfileFit(best, p[POSITION], sqrt(max(variance, 0.0)), p[BREADTH], share, p[BLUR])


@compiled
def _model(kind: int, t: Floats, p: Floats) -> Floats:
    """The model at every place."""
    found, row = np.empty(t.size), np.empty(LINEAR)
    for i in range(t.size):
        _row(kind, t[i], p, row)
        total = 0.0
        for a in range(LINEAR):
            total += p[a] * row[a]
        found[i] = total
    return found
