"""Gamma: the camera's transfer curve is assumed and was not measured."""

from fingervision.inspection.finding import Finding, weighed
from fingervision.inspection.sample import SURELY, Sample

REMEDY = (
    "Switch the camera's gamma off, or measure the response (`fingervision calibrate response`) and give it to "
    "calibrate and measure with --response."
)
FORMULA = (
    "probability of the other response, from the shape of the edges, times the shift of the gap that it would cause"
)


def find(sample: Sample) -> Finding | None:
    """Judge from the shape of the edges which camera response was applied to the stored levels."""
    seen = sample.response
    if not seen.other:
        words = f"The camera's response is known ({seen.assumed})."
        return weighed(sample, "gamma", 0.0, words, "", FORMULA) if sample.looks else None
    if not sample.looks:
        return None
    share = seen.share_other
    cost_px = share * abs(seen.shift_px)
    is_doubt = share < SURELY
    if not 1.0 - SURELY < share < SURELY:
        more_even = seen.other if share > 0.5 else seen.assumed
        figure = (
            f"The shape of the edges is that of a camera with {more_even} levels; the levels are assumed to be "
            f"{seen.assumed}, and the other response would change the gap by {abs(seen.shift_px):.2f} px."
        )
    else:
        figure = (
            f"The shape of the edges does not distinguish {seen.assumed} from {seen.other} levels (probability of "
            f"{seen.other}: {100 * share:.0f} %); the gap would change by {abs(seen.shift_px):.2f} px."
        )
    return weighed(sample, "gamma", cost_px, figure, REMEDY, FORMULA, is_doubt=is_doubt)
