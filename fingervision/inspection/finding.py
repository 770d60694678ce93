"""Finding about one limit of a set-up."""

from dataclasses import dataclass
from enum import StrEnum
from math import sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fingervision.domain.status import Status
    from fingervision.inspection.sample import Sample

# A limit that costs less than this (pixels, standard) is not worth mending: a good set-up (contrast of 100 levels,
# noise of 2, blur of 1.2 px, 20 rows) is known no better (measuring.md, section 2).
GOOD_PX = 0.0106 * 2.0**0.5
# What costs so many times more is the first thing to mend: it alone makes nine tenths of the uncertainty.
POOR_TIMES = 3.0
# Refusals of fewer frames than this share (a part that passes, a hand) are counted in the report's first line only.
FEW_REFUSED = 0.2
# Where more than this share is refused nothing else matters; where less is, what the others suffer from is the cause.
MOSTLY_REFUSED = 0.5


class Severity(StrEnum):
    """A traffic light."""

    GOOD = "good"
    FAIR = "fair"
    POOR = "poor"


@dataclass(frozen=True, slots=True)
class Finding:
    """One limit of a measurement.

    Parameters
    ----------
    name : str
        Which limit.
    severity : Severity
        Traffic light: green, amber, red.
    figure : str
        What was seen, with numbers, in a sentence.
    cost_px : float or None
        What it costs: the standard uncertainty (or the error, where it has one) that the gap would lose if this alone
        were mended. None where it keeps frames from being measured at all.
    cost_um : float or None
        The same in micrometres; None also without a scale.
    remedy : str
        What to change, in a sentence; empty where there is nothing to mend.
    formula : str
        Where the cost comes from.
    share_refused : float
        Share of the frames that it keeps from being measured.
    is_doubt : bool
        Whether it may be there or not: better pictures would settle it, so what spoils them goes first.
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
        """Sort key, larger is worse: missing numbers first, then certain findings, then doubts, each by cost."""
        sure = self.severity is not Severity.GOOD and not self.is_doubt
        first = self.share_refused if self.share_refused > MOSTLY_REFUSED else 0.0
        return first, sure, self.cost_px or 0.0


def severity_of(cost_px: float, good_px: float) -> Severity:
    """Severity (traffic light) of a cost in pixels; costs below `good_px` are not worth correcting."""
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
    """Make the finding of a cost in pixels: its severity, and its micrometres where the scale is known."""
    severity = severity_of(cost_px, sample.good_px)
    cost_um = None if sample.scale is None else 1e3 * cost_px / sample.scale.px_per_mm
    remedy = "" if severity is Severity.GOOD else remedy
    return Finding(name, severity, figure, cost_px, cost_um, remedy, formula, is_doubt=is_doubt)


def refusing(sample: "Sample", name: str, statuses: tuple["Status", ...], remedy: str) -> Finding | None:
    """Finding of frames that have no number for one of these reasons; None where they are too few."""
    count = sum(sample.counts[status] for status in statuses)
    if not count or count < FEW_REFUSED * sample.frames:
        return None
    words = next(sample.refused[status].words for status in statuses if status in sample.refused)
    figure = f"{count} of {sample.frames} frames gave no number: {words[0].lower()}{words[1:]}"
    share = count / sample.frames
    return Finding(name, Severity.POOR, figure, None, None, remedy, "frames without a number", share)


def without(u_px: float, mended_px: float) -> float:
    """Part of the standard uncertainty that is removed if `u_px` becomes `mended_px`: the quadratic difference."""
    return sqrt(max(u_px**2 - mended_px**2, 0.0))
