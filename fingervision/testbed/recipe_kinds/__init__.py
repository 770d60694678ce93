"""Steps of a recipe and the motion segments into which they are divided; a module for each kind of step.

The record `Step` of a kind declares its keys, and its method `acts` returns the segments.
"""

import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Protocol

from fingervision.domain.field import Field, declared
from fingervision.storage.toml_section import Section

CONTINUOUS = "continuous"
From = Annotated[float, Field("position to which the stage moves first, if it stands elsewhere", "mm")]
To = Annotated[float, Field("position at which the motion ends", "mm")]
Speed = Annotated[float, Field("speed of the motion", "mm/s", above=0.0)]
Frames = Annotated[
    int | None,
    Field(
        f'`"{CONTINUOUS}"`, or a number of frames to record at each point, once the picture is still', low=1, high=10000
    ),
]
"""Number of frames at each point; None, which a recipe states by a word, records every frame."""


@dataclass(frozen=True, slots=True)
class Go:
    """Segment: move to a position; a requested number of frames is recorded there."""

    to_mm: float
    speed_mm_s: float
    frames: Frames = None


@dataclass(frozen=True, slots=True)
class Stand:
    """Segment: rest for a time; a requested number of frames is recorded afterwards."""

    seconds: float
    frames: Frames = None


@dataclass(frozen=True, slots=True)
class Swing:
    """Segment: oscillate sinusoidally about a mean position, starting from the mean towards opening."""

    mean_mm: float
    amplitude_mm: float
    frequency_hz: float
    cycles: float


@dataclass(frozen=True, slots=True)
class Close:
    """Segment: close until the force limit is reached, the fingers touch, or the test bed's limit is reached."""

    speed_mm_s: float
    below_force_n: float


@dataclass(frozen=True, slots=True)
class Rezero:
    """Segment: reference the stage again; a new run begins."""


@dataclass(frozen=True, slots=True)
class Turn:
    """Segment: ask the operator to turn the part by 180 degrees in the picture; a new run begins."""


@dataclass(frozen=True, slots=True)
class Shift:
    """Segment: ask the operator to shift the picture; a new run begins."""


@dataclass(frozen=True, slots=True)
class Slot:
    """Segment: ask the operator to insert a reference slot, measure it, and ask for its removal."""

    size_mm: float
    u_size_mm: float


Act = Go | Stand | Swing | Close | Rezero | Turn | Shift | Slot


@dataclass(frozen=True, slots=True)
class Leg:
    """One motion segment as planned, and the recipe step to which it belongs.

    Parameters
    ----------
    act : Act
        What the test bed does.
    step : int
        Number of the recipe step, from 1.
    section : Section
        The recipe step.
    key : str
        Setting of the step from which the segment follows.
    seconds : float
        Expected duration.
    end_mm : float
        Position of the stage afterwards.
    speed_mm_s : float
        Highest speed; 0 without a motion.
    reached_mm : tuple of float
        Positions that the recipe states.
    """

    act: Act
    step: int
    section: Section
    key: str
    seconds: float
    end_mm: float
    speed_mm_s: float = 0.0
    reached_mm: tuple[float, ...] = ()

    @property
    def is_continuous(self) -> bool:
        """Whether every frame of the segment is recorded."""
        act = self.act
        return isinstance(act, Swing | Close) or (isinstance(act, Go | Stand) and act.frames is None)

    @property
    def words(self) -> str:
        """Description of the segment in words."""
        match self.act:
            case Go(to_mm, speed, _):
                return f"to {to_mm:g} mm at {speed:g} mm/s"
            case Stand(seconds, _):
                return f"rest for {seconds:g} s"
            case Swing(mean_mm, amplitude_mm, frequency_hz, _):
                return f"oscillate about {mean_mm:g} mm with an amplitude of {amplitude_mm:g} mm at {frequency_hz:g} Hz"
            case Close(speed, force_n):
                return f"close at {speed:g} mm/s below {force_n:g} N"
            case Slot(size_mm, _):
                return f"measure the slot of {size_mm:g} mm"
        return self.act.__class__.__name__.lower()


Asked = tuple[Act, str]
"""An action, and the setting of the recipe from which it follows."""


class StepKind(Protocol):
    """Record of a kind of recipe step: its fields are the keys, its docstring says what the test bed does."""

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Actions of the test bed for a recipe step that starts at a given position of the stage."""
        ...


def step_kinds() -> dict[str, type[StepKind]]:
    """The records of all kinds by their names, sorted."""
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return {name: importlib.import_module(f"{__name__}.{name}").Step for name in names}


def step_of(section: Section) -> StepKind:
    """Read a step of a recipe.

    Raises
    ------
    DataError
        The kind is unknown, or its keys are not those that it declares.
    """
    kinds = step_kinds()
    kind, frames = kinds[section.word("kind", of=kinds)], section.values.get("frames", CONTINUOUS)
    if isinstance(frames, str) and frames != CONTINUOUS:
        section.refuse("frames", f'must be "{CONTINUOUS}" or a number of frames for each point, but is {frames!r}.')
    beside = {"kind"} | ({"frames"} if frames == CONTINUOUS else set())
    keys = {key: value for key, value in section.values.items() if key not in beside}
    return replace(section, values=keys).record(kind)


def words_of(kind: type[StepKind]) -> str:
    """What the test bed does in a step of a kind, as a sentence."""
    return (kind.__doc__ or "").partition("\n")[0]


def described(name: str) -> str:
    """The keys of a kind of step with their units, limits and meanings, one in a line."""
    lines = [f"{name}: {words_of(step_kinds()[name])}"]
    for each in declared(step_kinds()[name]):
        unit = f" ({each.field.unit})" if each.field.unit else ""
        may = "" if each.is_required else "optional: "
        lines.append(f"  {each.name:14} {may}{each.field.meaning.replace('`', '')}{unit}")
    return "\n".join(lines)
