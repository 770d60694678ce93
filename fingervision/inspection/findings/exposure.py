"""Exposure: levels clipped at the end of the scale, or only a small part of the scale used."""

from math import hypot

from fingervision.domain.status import Status
from fingervision.inspection.finding import Finding, refusing, weighed, without
from fingervision.inspection.noise_bound import GOOD_NOISE
from fingervision.inspection.plateaus import plateaus
from fingervision.inspection.sample import Sample

# Wanted level of the brighter plateau (share of full scale), and level below which it is too dark.
WANTED, DIM = 0.8, 0.5
LESS = "Shorten the exposure, or dim the light, until no grey level reaches full scale; keep automatic exposure off."
MORE = "Lengthen the exposure, or give more light, until the background reaches about 80 % of full scale."
UNDER = (
    "sqrt(u^2 - u'^2 + s^2); u is the random uncertainty, u' the random uncertainty with the contrast at full "
    "exposure (Cramer-Rao bound); s is u_shift_px if the noise prevents an inspection of the surroundings, else 0"
)
OVER = "u_shift_px, the shift of an edge whose levels are clipped at the end of the scale"


def find(sample: Sample) -> Finding | None:
    """Judge the exposure from the levels on both sides of the edges."""
    refused = refusing(sample, "exposure", (Status.SATURATED,), LESS) or refusing(
        sample, "exposure", (Status.LOW_CONTRAST,), MORE
    )
    if refused is not None or not sample.looks:
        return refused
    levels = plateaus(sample)
    if levels.is_cut:
        shift_px = sample.median(look.outcome.u_shift_px for look in sample.looks)
        end = "white" if levels.at_top >= levels.at_zero else "black"
        share = max(levels.at_top, levels.at_zero)
        figure = f"{100 * share:.0f} % of the pixels beside the edges are {end}: their grey levels are clipped."
        return weighed(sample, "exposure", shift_px, figure, LESS if end == "white" else MORE, OVER)
    factor = WANTED / max(levels.bright, 1e-3) if levels.bright < DIM else 1.0
    cost_px = sample.median(
        without(look.u_with(), look.u_with(noise=max(look.noise / factor, min(GOOD_NOISE, look.noise))))
        for look in sample.looks
    )
    if levels.bright < DIM and not sample.shows_surroundings:
        cost_px = hypot(cost_px, sample.u_shift_px)
    figure = f"The brighter side of the edges has {100 * levels.bright:.0f} % of full scale (50 to 90 % is good)."
    return weighed(sample, "exposure", cost_px, figure, MORE, UNDER)
