"""Report of a diagnosis: the record from which report.json and report.html are written."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

from fingervision.domain.parameter import Estimate


class Verdict(StrEnum):
    """The four answers."""

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
        As in the catalogue.
    parameters : mapping of str to Estimate
        By their keys, which every file uses.
    points : tuple of (float, float)
        The curve of a map, input and error in mm.
    place : str
        The hinge or link that it is the effect of, as the drawing calls it; empty where the effect has no place.
    end : str
        The end of a link that sits off; likewise.
    shown : mapping of str to str
        Display names by key, as the effect's own file declares them; for sentences, pages and figures.
    """

    name: str
    stage: str
    parameters: Mapping[str, Estimate]
    points: tuple[tuple[float, float], ...] = ()
    place: str = ""
    end: str = ""
    shown: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def display_name(self, key: str) -> str:
        """Return the name of a parameter that people read; its key where no such name is declared."""
        return self.shown.get(key, key)


@dataclass(frozen=True, slots=True)
class Place:
    """A region where the residual cannot be noise: channel, variable, limits, size, significance, and a sentence."""

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
    """RMS of measured minus predicted gap in mm, without the constant of the midline.

    `unseen` is the same with each run predicted from the other runs.
    """

    before_rms_mm: float
    after_rms_mm: float
    noise_rms_mm: float
    unseen_before_rms_mm: float | None
    unseen_after_rms_mm: float | None
    by_channel: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class NextRun:
    """The run that would best separate the open explanations: its steps, and its expected chi-square gain."""

    name: str
    steps: tuple[Mapping[str, object], ...]
    gain: float
    gain_interval: tuple[float, float]
    separates: tuple[str, ...]
    words: str


@dataclass(frozen=True, slots=True)
class DiagnosisReport:
    """The result of a diagnosis, with the fields of report.json.

    `explained_share` is 1 - (after / before)^2, `standing_share` after / before, both of the disagreement without the
    runs' scatter and outliers; `pure_error_mm` is the scatter of repeats of the gap, None where nothing repeats.
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
    runners_up: tuple[Mapping[str, object], ...]
    notes: tuple[str, ...]
    seconds: float
