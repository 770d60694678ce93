"""Motion segments: the elementary actions into which a recipe's steps are divided."""

from dataclasses import dataclass

from fingervision.storage.toml_section import Section

Frames = int | None
"""So many frames at a point once the picture is still; None records every frame all the while."""


@dataclass(frozen=True, slots=True)
class Go:
    """Move to a position; frames, if requested by number, are taken there."""

    to_mm: float
    speed_mm_s: float
    frames: Frames = None


@dataclass(frozen=True, slots=True)
class Stand:
    """Stand for a time; frames, if requested by number, are taken after it."""

    seconds: float
    frames: Frames = None


@dataclass(frozen=True, slots=True)
class Swing:
    """Oscillate as a sine about a mean, starting from the mean towards opening."""

    mean_mm: float
    amplitude_mm: float
    frequency_hz: float
    cycles: float


@dataclass(frozen=True, slots=True)
class Close:
    """Close until the force limit is reached, the fingers touch, or the bed's limit is reached."""

    speed_mm_s: float
    below_force_n: float


@dataclass(frozen=True, slots=True)
class Rezero:
    """Reference the stage again; a new run begins."""


@dataclass(frozen=True, slots=True)
class Turn:
    """Have the part turned by 180 degrees in the picture; a new run begins."""


@dataclass(frozen=True, slots=True)
class Shift:
    """Have the picture shifted; a new run begins."""


@dataclass(frozen=True, slots=True)
class Slot:
    """Have a reference slot put in, measure it, and have it taken out."""

    size_mm: float
    u_size_mm: float


Act = Go | Stand | Swing | Close | Rezero | Turn | Shift | Slot


@dataclass(frozen=True, slots=True)
class Leg:
    """One segment, and the recipe step to which it belongs.

    Parameters
    ----------
    act : Go, Stand, Swing, Close, Rezero, Turn, Shift or Slot
        What.
    step : int
        Step of the recipe, from 1.
    section : Section
        The step as it is written, for sentences.
    key : str
        The key that it follows from.
    """

    act: Act
    step: int
    section: Section
    key: str = "kind"

    @property
    def words(self) -> str:
        """Description of the segment in words."""
        match self.act:
            case Go(to_mm, speed, _):
                return f"to {to_mm:g} mm at {speed:g} mm/s"
            case Stand(seconds, _):
                return f"stand for {seconds:g} s"
            case Swing(mean_mm, amplitude_mm, frequency_hz, _):
                return f"swing about {mean_mm:g} mm by {amplitude_mm:g} mm at {frequency_hz:g} Hz"
            case Close(speed, force_n):
                return f"close at {speed:g} mm/s below {force_n:g} N"
            case Slot(size_mm, _):
                return f"measure the slot of {size_mm:g} mm"
        return self.act.__class__.__name__.lower()
