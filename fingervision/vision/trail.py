"""Trail behind a moving edge: temporal noise reduction in a camera mixes earlier pictures into each picture.

A recursive filter adds to every picture a share of the picture before it, so that a moving edge is followed by ever
weaker copies of itself. The spread of light is then that of the optics convolved with an exponential on one side of the
edge. Motion during the exposure spreads the light evenly to both sides of the mean position and displaces nothing; a
trail displaces the fitted step backwards by its mean length. The side tells a trail from what stands beside an edge: on
the two flanks of a finger a trail points the same way in the picture, a wall, shadow or glare to opposite ways.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfcx, ndtr

from fingervision.vision.edge_moves import stated_marks, unsure_edges
from fingervision.vision.edges import EdgePoints
from fingervision.vision.mean_profile import MeanProfile

Floats = NDArray[np.float64]

# Mean lengths of the trail that are tried (pixels, positive outwards): in steps of a quarter of the usual blur or of a
# third of the length, up to the longest trail of which most lies within the window.
LENGTHS_PX = np.array([0.2, 0.4, 0.6, 0.85, 1.2, 1.7, 2.4, 3.4, 4.8])
TRIED_PX = np.concatenate((-LENGTHS_PX[::-1], (0.0,), LENGTHS_PX))
SPACING_PX = np.gradient(TRIED_PX)
# Lengths of which one shows a quarter of the gain of any other one: the effect grows with the length's cube.
FIRST_PX, FIRST_SHARE = np.array([-2.4, -1.2, -0.6, 0.0, 0.6, 1.2, 2.4]), 0.25
# Sharpening and the tails of real optics: a step with this multiple of the blur minus the step itself, as in the other
# models of a profile.
TAIL_BLURS = 2.2
# Gauss-Newton steps for position and blur at each length, and least blur (pixels).
LOOKS, LEAST_BLUR_PX = 5, 0.35
# Length (pixels) below which a trail is none.
SHORTEST_PX = 1e-3
# Standard deviation of a real edge about the models, as a share of its contrast (half-pixel bins).
DISCREPANCY = 0.004
# Number of parameters of the model (level, contrast, tail, position, blur, length).
PARAMETERS = 6
# Reductions of chi-square above which one finger, or both together, have a trail: three standard uncertainties. Each
# flank contributes at least this share of it; a wall or a shadow is seen on one flank of a finger only.
SURE_OF_ONE, SURE_OF_BOTH, LEAST_SHARE = 9.0, 11.8, 0.1


def with_trail(edges: EdgePoints, profiles: list[list[MeanProfile | None]], blur: list[float]) -> EdgePoints | None:
    """Edges with the uncertainty that a trail behind the fingers means; None if there is no trail.

    The fitted step is at the mean position over the mixed pictures, and the edge of the last picture is one mean length
    ahead of it. The light of a single exposure, during which a finger changed its speed, may look the same, and then
    the mean position is the right one. The edges are therefore left in place, and the true ones lie anywhere between
    the two positions (a rectangular distribution, as for `unsure_edges`).

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line; the outer flanks of both fingers are in view.
    profiles : list of [MeanProfile or None, MeanProfile or None]
        Mean profiles across the inner and the outer flank, for each finger.
    blur : list of float
        Blur of each finger's flanks (pixels).
    """
    weight = 1.0 / edges.noise_flat**2
    # One flank alone does not tell a trail from a shadow or a wall.
    both = [
        (inner, outer, width)
        for (inner, outer), width in zip(profiles, blur, strict=True)
        if inner is not None and outer is not None
    ]
    if not _is_enough([_gain(_both_squares(*pair, weight, FIRST_PX)) for pair in both], FIRST_SHARE):
        return None
    seen = [_both_squares(*pair, weight, TRIED_PX) for pair in both]
    if not _is_enough([_gain(each) for each in seen]):
        return None
    likely = [np.exp(0.5 * (each.sum(axis=0).min() - each.sum(axis=0))) * SPACING_PX for each in seen]
    known = [float(own @ TRIED_PX / own.sum()) for own in likely]
    if len(known) < len(profiles):  # the other finger may move in the same way, or in the opposite way
        return unsure_edges(edges, [abs(known[0])] * len(profiles), "trail")
    # With their signs: optics that spread light to one side of every edge (coma) do not change the gap.
    marks = stated_marks(edges, [length / np.sqrt(3.0) for length in known])
    return replace(edges, marks=marks, beside="trail")


def _both_squares(inner: MeanProfile, outer: MeanProfile, blur: float, weight: float, tried_px: Floats) -> Floats:
    """Chi-square of both flanks for lengths towards the gap, which is outwards for the inner flank only."""
    squares = [trail_squares(inner, weight, blur, tried_px), trail_squares(outer, weight, blur, tried_px)[::-1]]
    return np.array(squares)


def _gain(squares: Floats) -> float:
    """Reduction of chi-square by a trail; none if it is not seen on both flanks."""
    gain = squares[:, squares.shape[1] // 2] - squares[:, int(np.argmin(squares.sum(axis=0)))]
    return float(gain.sum()) if gain.min() > LEAST_SHARE * gain.sum() else -np.inf


def _is_enough(gains: list[float], share: float = 1.0) -> bool:
    """Whether one finger, or both together, surely have a trail, from their gains."""
    return bool(gains) and (max(gains) > share * SURE_OF_ONE or sum(gains) > share * SURE_OF_BOTH)


def trail_squares(profile: MeanProfile, weight: float, blur: float, tried_px: Floats = TRIED_PX) -> Floats:
    """Chi-square of a step with an exponential trail, for each of some lengths, in units of the least residual.

    Parameters
    ----------
    profile : MeanProfile
        Mean light across the flank.
    weight : float
        Inverse of the variance of the light of one pixel.
    blur : float
        Blur of the fitted single step (pixels).
    tried_px : ndarray of float, shape (n,)
        Mean lengths of the trail, positive outwards.
    """
    t, own = profile.t, DISCREPANCY * float(np.ptp(profile.light))
    root = 1.0 / np.sqrt(1.0 / (profile.count * weight) + own**2)
    length = tried_px[:, None]
    place, width = -tried_px.copy(), np.sqrt(np.maximum(blur**2 - tried_px**2, (0.5 * blur) ** 2))
    squares = np.full(tried_px.size, np.inf)
    value = root * profile.light
    for look in range(LOOKS):
        away = t - place[:, None]
        sigma = width[:, None]
        step, slope, by_width = _step(away, sigma, length)
        tail = _step(away, TAIL_BLURS * sigma, length)[0] - step
        columns = root[:, None] * np.stack((np.ones_like(step), step, tail, -slope, by_width), axis=2)
        normal = np.swapaxes(columns, 1, 2) @ columns
        normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(5)
        right = columns.swapaxes(1, 2) @ value
        linear = np.linalg.solve(normal[:, :3, :3], right[:, :3, None])[:, :, 0]
        squares = np.minimum(squares, np.sum((value - np.einsum("ijk,ik->ij", columns[:, :, :3], linear)) ** 2, axis=1))
        if look == LOOKS - 1:
            break
        found = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
        contrast = np.where(np.abs(found[:, 1]) > 1e-9, found[:, 1], 1.0)
        place = place + np.clip(found[:, 3] / contrast, -0.5, 0.5)
        width = np.maximum(width * np.clip(1.0 + found[:, 4] / contrast / width, 0.7, 1.4), LEAST_BLUR_PX)
    return squares / max(float(squares.min()) / max(t.size - PARAMETERS, 1), 1.0)


def _step(away: Floats, sigma: Floats, length: Floats) -> tuple[Floats, Floats, Floats]:
    """Step blurred by a Gaussian and by an exponential of a mean length, and its derivatives by place and by sigma.

    The length is positive outwards. The blurred step s fulfils s + L s' = Phi(x / sigma), and its derivative by sigma
    is sigma s'', as that of every Gaussian blur.
    """
    sign = np.where(length < 0.0, -1.0, 1.0)
    x, size = sign * away, np.abs(length)
    plain, density = ndtr(x / sigma), np.exp(-0.5 * (x / sigma) ** 2)
    is_short, size = size < SHORTEST_PX, np.maximum(size, SHORTEST_PX)
    # exp(-x / L + sigma^2 / 2 L^2) Phi(x / sigma - sigma / L), written by the scaled error function without overflow.
    z = (sigma / size - x / sigma) / np.sqrt(2.0)
    near = 0.5 * density * erfcx(np.maximum(z, -20.0))
    far = np.exp(np.minimum(-x / size + 0.5 * (sigma / size) ** 2, 700.0)) * ndtr(-z * np.sqrt(2.0))
    trailing = np.where(is_short, 0.0, np.where(z > -5.0, near, far))
    density /= np.sqrt(2.0 * np.pi) * sigma
    slope = np.where(is_short, density, trailing / size)
    by_width = np.where(is_short, -x * density / sigma, sigma * (density - slope) / size)
    one_sided = plain - trailing
    return np.where(sign > 0.0, one_sided, 1.0 - one_sided), slope, sign * by_width
