"""View: frames in which no two fingers were found."""

from fingervision.domain.status import Status
from fingervision.inspection.finding import Finding, Severity, refusing
from fingervision.inspection.sample import Sample

# Statuses that other findings report.
NAMED_ELSEWHERE = (Status.OK, Status.BLURRED, Status.SATURATED, Status.LOW_CONTRAST, Status.DUPLICATE)
WITHOUT_FINGERS = tuple(status for status in Status if status not in NAMED_ELSEWHERE)
REMEDY = (
    "Bring both fingers with their tips into view, with no other objects beside them; otherwise state the region of "
    "the fingers with --roi and the direction of the tips with --tips. `fingervision measure --steps 0` shows what "
    "was detected in the first frame."
)


def find(sample: Sample) -> Finding | None:
    """Count the frames in which no fingers were found."""
    refused = refusing(sample, "view", WITHOUT_FINGERS, REMEDY)
    # If outlines are lost in noise or blur, or the fingers are too small, the findings "light", "focus" and "scale"
    # report this.
    is_told = sample.is_lost_in_blur or sample.is_lost_in_smallness or (not sample.looks and sample.is_lost_in_noise)
    if refused is not None and not is_told:
        return refused
    measured = f"{sample.counts[Status.OK]} of {sample.frames} frames show two fingers and were measured."
    return Finding("view", Severity.GOOD, measured, 0.0, 0.0 if sample.scale else None, "", "frames without a gap")
