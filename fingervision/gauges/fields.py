"""Settings that a kind of gauge reads, determined by giving it a table that records every request."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from fingervision.gauges.kinds import kind_named
from fingervision.storage.toml_section import Section

# Value returned for a required number; this size suits most objects in a picture.
USUAL_PX = 40.0


@dataclass(frozen=True, slots=True)
class Field:
    """One setting of a kind of gauge.

    Parameters
    ----------
    key : str
        Name of the setting in the file.
    default : float, str or None
        Value if the setting is left out; None if it must be stated.
    low, high : float or None
        Limits of a number; None for no limit.
    choices : tuple of str
        Permitted words; empty for a number.
    """

    key: str
    default: float | str | None = None
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def usual(self) -> float | str:
        """Initial value of a setting for a new gauge."""
        if self.default is not None:
            return self.default
        if self.choices:
            return self.choices[0]
        low = -float("inf") if self.low is None else self.low
        high = float("inf") if self.high is None else self.high
        return min(max(USUAL_PX, low), high)


@dataclass(frozen=True, slots=True)
class _Noting(Section):
    """A table that contains every key, and records which keys are requested."""

    noted: dict[str, Field] = field(default_factory=dict)

    def number(
        self, key: str, default: float | None = None, *, low: float = -float("inf"), high: float = float("inf"),
        above: float | None = None,
    ) -> float:  # fmt: skip
        least = low if above is None else max(low, above)
        limits = [None if abs(limit) == float("inf") else limit for limit in (least, high)]
        self.noted[key] = asked = Field(key, default, limits[0], limits[1])
        return float(asked.usual)

    def word(self, key: str, default: str | None = None, *, of: Iterable[str] | None = None) -> str:
        self.noted[key] = asked = Field(key, default, choices=tuple(of or ("",)))
        return str(asked.usual)


@cache
def fields_of(kind_name: str) -> tuple[Field, ...]:
    """Settings of a kind of gauge, in their order, with defaults, limits and descriptions."""
    kind = kind_named(kind_name)
    noting = _Noting(Path(), "", "", {})
    kind.read(noting)
    return tuple(noting.noted.get(key, Field(key)) for key in kind.KEYS)
