"""Report of a diagnosis: the record from which report.json and report.html are written."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

from calib.short_repr import ShortRepr
from fingervision.domain.parameter import Estimate


class Verdict(StrEnum):
    """The four possible results of a diagnosis."""

    AGREES = "agrees"
    NAMED = "named"
    AMBIGUOUS = "ambiguous"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class NamedEffect:
    """One effect named by a diagnosis, with its parameters.

    Parameters
    ----------
    name, stage : str
        Name and stage of the effect in the catalogue.
    parameters : mapping of str to Estimate
        Estimated parameters by key; data files use the same keys.
    points : tuple of (float, float)
        Points (input and error, in mm) of the curve of an effect that is a curve.
    place : str
        Name in the drawing of the hinge or link that has the effect; empty for an effect without a place.
    end : str
        The end of a link that is displaced; empty for any other effect.
    shown : mapping of str to str
        Display names by key, as declared in the module of the effect; used in sentences, browser pages and plots.
    """

    name: str
    stage: str
    parameters: Mapping[str, Estimate]
    points: tuple[tuple[float, float], ...] = ()
    place: str = ""
    end: str = ""
    shown: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def display_name(self, key: str) -> str:
        """Return the display name of a parameter; if none is declared, its key."""
        return self.shown.get(key, key)


@dataclass(frozen=True, slots=True)
class Place:
    """A region in which the residual is significant: channel, variable, limits, size, significance, and a sentence."""

    channel: str
    variable: str
    start: float
    end: float
    size: float
    unit: str
    sigma: float
    words: str


@dataclass(frozen=True, slots=True)
class Disagreement:
    """RMS of measured minus predicted values in mm, of each finger's edge if both were measured, else of the gap.

    The constant offset of the midline is removed. `before_rms_mm`, `after_rms_mm` and `by_channel` are over all rows.

    Parameters
    ----------
    before_rms_mm, after_rms_mm, noise_rms_mm : float
        RMS without and with the named effects, and that which a true explanation would leave: the random noise of the
        gap, and of the recorded input.
    unseen_before_rms_mm, unseen_after_rms_mm : float or None
        The same from cross-validation: each run is predicted from a fit to the other runs.
    by_channel : mapping
        RMS without and with the named effects, by channel.
    counted_before_rms_mm, counted_after_rms_mm : float or None
        RMS from which the verdict and its shares are computed: without the rows left out, and without the runs'
        deviations from their common mean; None if they are those over all rows.
    rows, rows_left_out : int
        Number of rows with a gap, and of those that the verdict leaves out.
    of : str
        `edges` or `gap`: the quantity of which the values are the RMS.
    """

    before_rms_mm: float
    after_rms_mm: float
    noise_rms_mm: float
    unseen_before_rms_mm: float | None
    unseen_after_rms_mm: float | None
    by_channel: Mapping[str, Mapping[str, float]]
    counted_before_rms_mm: float | None = None
    counted_after_rms_mm: float | None = None
    rows: int = 0
    rows_left_out: int = 0
    of: str = "gap"

    @property
    def counted_mm(self) -> tuple[float, float]:
        """RMS without and with the named effects, from which the verdict and its shares are computed."""
        if self.counted_before_rms_mm is None or self.counted_after_rms_mm is None:
            return self.before_rms_mm, self.after_rms_mm
        return self.counted_before_rms_mm, self.counted_after_rms_mm


@dataclass(frozen=True, slots=True)
class NextRun:
    """The run that would best distinguish the remaining explanations: its steps, and its expected chi-square gain."""

    name: str
    steps: tuple[Mapping[str, object], ...]
    gain: float
    gain_interval: tuple[float, float]
    separates: tuple[str, ...]
    words: str


@dataclass(frozen=True, slots=True, repr=False)
class DiagnosisReport(ShortRepr):
    """The result of a diagnosis, with the fields of report.json.

    `unknown` says what no effect of the catalogue explains; it is None if nothing of that kind was found.
    `explained_share` is 1 - (after / before)^2 and `standing_share` is after / before, where `before` and `after` are
    the counted RMS of the disagreement: without outliers and the scatter between runs. `pure_error_mm` is the standard
    deviation of replicates of the gap, None without replicates. `outlier_rows` describes each row set aside in the fit.
    `runners_up` lists single effects, each with the share of the disagreement that it explains alone. `next_step` says
    what to do next, whatever the verdict.
    """

    verdict: Verdict
    sentence: str
    effects: tuple[NamedEffect, ...]
    alternatives: tuple[tuple[str, ...], ...]
    where: tuple[Place, ...]
    disagreement: Disagreement
    explained_share: float
    standing_share: float
    pure_error_mm: float | None
    smallest_seen: Mapping[str, Mapping[str, object]]
    unknown: str | None
    remaining: str
    next_run: NextRun | None
    excluded: tuple[Mapping[str, str], ...]
    outliers: tuple[str, ...]
    outlier_rows: tuple[Mapping[str, object], ...]
    runners_up: tuple[Mapping[str, object], ...]
    notes: tuple[str, ...]
    seconds: float
    next_step: str = ""
