"""Light: low contrast between fingers and background, noise, and uneven light across an edge."""

from math import hypot

import numpy as np

from fingervision.inspection.blocks import HEAVY
from fingervision.inspection.finding import Finding, Severity, weighed, without
from fingervision.inspection.findings.exposure import DIM, WANTED
from fingervision.inspection.ground_slope import ground_slope
from fingervision.inspection.noise_bound import GOOD_NOISE
from fingervision.inspection.plateaus import plateaus
from fingervision.inspection.sample import Sample

WEAK = "Light the background from behind, or darken the fingers, and lower the camera's gain."
UNEVEN = "Make the light uniform across the gap: use a diffuser behind the fingers, at a larger distance from them."
FORMULA = (
    "sqrt(n^2 + e^2 + s^2); n = sqrt(u^2 - u'^2), u the random uncertainty, u' the random uncertainty with noise of 2 "
    "% of the contrast (Cramer-Rao bound); e is the change of the gap by the slope of the background over half of the "
    "gap; s is u_shift_px if noise or uneven light causes it, else 0"
)


def find(sample: Sample) -> Finding | None:
    """Compare the noise with the contrast, and state what the slope of the background's light does to the gap."""
    if not sample.looks:
        return _lost(sample)
    bright = plateaus(sample).bright
    # The part of the noise that a longer exposure would remove belongs to the finding "exposure".
    factor = WANTED / max(bright, 1e-3) if bright < DIM else 1.0
    noise = sample.median(look.noise / factor for look in sample.looks)
    weak_px = sample.median(
        without(look.u_with(noise=each), look.u_with(noise=min(GOOD_NOISE, each)))
        for look in sample.looks
        for each in (look.noise / factor,)
    )
    # Clipped levels, motion and block artefacts distort the profile, so that uneven light cannot be judged.
    is_spoilt = plateaus(sample).is_cut or sample.moves or sample.blockiness > HEAVY
    uneven_px = 0.0 if is_spoilt else uneven_light_px(sample)
    # The measurement cannot distinguish uneven light from a soft shadow, and noise can hide either.
    is_lights = uneven_px > 0.0 or (not sample.shows_surroundings and bright >= DIM)
    noisy_px = sample.u_shift_px if is_lights else 0.0
    cost_px = float(np.linalg.norm((weak_px, uneven_px, noisy_px)))
    contrast = sample.median(look.contrast for look in sample.looks) / sample.top_level
    figure = (
        f"Contrast is {100 * contrast:.0f} % of full scale, noise {100 * noise:.1f} % of the contrast "
        f"({100 * GOOD_NOISE:g} % or less is good); uneven light changes the gap by {uneven_px:.3f} px."
    )
    return weighed(sample, "light", cost_px, figure, UNEVEN if uneven_px > weak_px else WEAK, FORMULA)


def _lost(sample: Sample) -> Finding | None:
    """Finding for frames without a measured gap because no contrast in them exceeds the noise."""
    if not sample.is_lost_in_noise:
        return None
    words = "No frame has a gap, and the contrast in the picture hardly exceeds the noise."
    return Finding("light", Severity.POOR, words, None, None, WEAK, "frames without a gap", 1.0)


def uneven_light_px(sample: Sample) -> float:
    """Change of the gap by the slopes of the background over half of the gap, beyond that of a pattern (pixels)."""
    levels = int(np.iinfo(sample.looks[0].upright.dtype).max) + 1
    light = sample.settings.response.table(sample.top_level, levels)
    slopes = [ground_slope(sample.looks, side, light) for side in range(2)]
    if slopes[0] is None or slopes[1] is None:
        return 0.0
    moved, u_px = slopes[0].moves_px + slopes[1].moves_px, hypot(slopes[0].u_px, slopes[1].u_px)
    return without(abs(moved), SLOPE_SIGMAS * u_px)


# A change of the gap within this number of standard uncertainties is a pattern: 99 % of Student's distribution with the
# six degrees of freedom of two flanks in four parts.
SLOPE_SIGMAS = 3.7
