"""Motion segments: the elementary actions into which the steps of a recipe are divided."""

from dataclasses import dataclass

from fingervision.storage.toml_section import Section

Frames = int | None
"""Number of frames taken at a point once the picture is at rest; None records all frames continuously."""


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
