"""Finding: one property of a set-up that limits the measurement."""

from dataclasses import dataclass
from enum import StrEnum
from math import sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fingervision.domain.status import Status
    from fingervision.inspection.sample import Sample

# Cost (standard uncertainty in pixels) below which a limit is not worth correcting: the standard uncertainty of a good
# set-up with a contrast of 100 levels, noise of 2 levels, blur of 1.2 px and 20 rows.
GOOD_PX = 0.0106 * 2.0**0.5
# Ratio of a cost to that of a good set-up above which the severity is red; at this ratio the limit alone causes nine
# tenths of the variance.
POOR_TIMES = 3.0
# A smaller share of unmeasured frames (a passing part, a hand) gives no finding of its own.
FEW_REFUSED = 0.2
# Above this share of unmeasured frames, the reason for them is the first finding; below it, the other findings explain
# them.
MOSTLY_REFUSED = 0.5


class Severity(StrEnum):
    """Severity of a finding, as a traffic light."""

    GOOD = "good"
    FAIR = "fair"
    POOR = "poor"


@dataclass(frozen=True, slots=True)
class Finding:
    """One property of a set-up that limits the measurement.

    Parameters
    ----------
    name : str
        Name of the limit.
    severity : Severity
        Severity: green, amber or red.
    figure : str
        Sentence with the observed numbers.
    cost_px : float or None
        Cost: the standard uncertainty of the gap (or the error, if the limit causes one) that would be removed if only
        this limit were corrected. None if the limit prevents frames from being measured.
    cost_um : float or None
        Cost in micrometres; None without a scale, or if `cost_px` is None.
    remedy : str
        Sentence that says what to change; empty if nothing needs to be corrected.
    formula : str
        Formula or source of the cost.
    share_refused : float
        Share of the frames that the limit prevents from being measured.
    is_doubt : bool
        Whether the finding is uncertain: better pictures would decide it, so that the causes of bad pictures must be
        corrected first.
    """

    name: str
    severity: Severity
    figure: str
    cost_px: float | None
    cost_um: float | None
    remedy: str
    formula: str
    share_refused: float = 0.0
    is_doubt: bool = False

    @property
    def rank(self) -> tuple[float, bool, float]:
        """Sort key, larger is worse: unmeasured frames, then certain findings, then uncertain findings, all by cost."""
        sure = self.severity is not Severity.GOOD and not self.is_doubt
        first = self.share_refused if self.share_refused > MOSTLY_REFUSED else 0.0
        return first, sure, self.cost_px or 0.0


def severity_of(cost_px: float, good_px: float) -> Severity:
    """Severity of a cost in pixels; costs below `good_px` are not worth correcting."""
    if cost_px <= good_px:
        return Severity.GOOD
    return Severity.FAIR if cost_px <= POOR_TIMES * good_px else Severity.POOR


def weighed(
    sample: "Sample",
    name: str,
    cost_px: float,
    figure: str,
    remedy: str,
    formula: str,
    *,
    is_doubt: bool = False,
) -> Finding:
    """Make a finding from a cost in pixels: add its severity, and the cost in micrometres if the scale is known."""
    severity = severity_of(cost_px, sample.good_px)
    cost_um = None if sample.scale is None else 1e3 * cost_px / sample.scale.px_per_mm
    remedy = "" if severity is Severity.GOOD else remedy
    return Finding(name, severity, figure, cost_px, cost_um, remedy, formula, is_doubt=is_doubt)


def refusing(sample: "Sample", name: str, statuses: tuple["Status", ...], remedy: str) -> Finding | None:
    """Finding for frames without a gap that have one of the given statuses; None if there are too few such frames."""
    count = sum(sample.counts[status] for status in statuses)
    if not count or count < FEW_REFUSED * sample.frames:
        return None
    words = next(sample.refused[status].words for status in statuses if status in sample.refused)
    figure = f"{count} of {sample.frames} frames have no gap: {words[0].lower()}{words[1:]}"
    share = count / sample.frames
    return Finding(name, Severity.POOR, figure, None, None, remedy, "frames without a gap", share)


def without(u_px: float, mended_px: float) -> float:
    """Part of the standard uncertainty that is removed if `u_px` becomes `mended_px` (quadratic difference)."""
    return sqrt(max(u_px**2 - mended_px**2, 0.0))
