"""Focus: edges blurred by the optics have a larger uncertainty."""

from fingervision.domain.status import Status
from fingervision.inspection.finding import MOSTLY_REFUSED, Finding, Severity, refusing, weighed, without
from fingervision.inspection.noise_bound import GOOD_BLUR_PX
from fingervision.inspection.sample import Sample

REMEDY = "Focus on the tips and fix the focus, or close the aperture; keep automatic focus off."
FORMULA = (
    "sqrt(u^2 - u'^2); u is the random uncertainty, u' the random uncertainty with a blur of 1.3 px (Cramer-Rao bound)"
)


def find(sample: Sample) -> Finding | None:
    """Compare the blur of the edges, without motion blur, with that of a lens in focus."""
    blurred = (Status.BLURRED, Status.NO_FINGERS) if sample.is_lost_in_blur else (Status.BLURRED,)
    refused = None if sample.is_smeared else refusing(sample, "focus", blurred, REMEDY)
    if not sample.looks or (refused is not None and refused.share_refused > MOSTLY_REFUSED):
        return refused
    if sample.moves:
        words = (
            "The fingers move while the shutter is open, so that the focus cannot be judged: inspect fingers at rest."
        )
        return weighed(sample, "focus", 0.0, words, REMEDY, FORMULA)
    blur_px = sample.median(look.focus_blur_px for look in sample.looks)
    cost_px = sample.median(
        without(look.u_with(blur_px=look.focus_blur_px), look.u_with(blur_px=min(GOOD_BLUR_PX, look.focus_blur_px)))
        for look in sample.looks
    )
    figure = f"The blur of the edges is {blur_px:.2f} px (standard deviation; {GOOD_BLUR_PX:g} px or less is sharp)."
    found = weighed(sample, "focus", cost_px, figure, REMEDY, FORMULA)
    # The frames that were measured tell the cost, if it is one; otherwise the refused frames alone are the finding.
    return refused if refused is not None and found.severity is Severity.GOOD else found
