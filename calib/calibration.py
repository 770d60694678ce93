"""The scale of a flat scene, and how surely it is known."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BareScale:
    """A scale that somebody states, without an uncertainty.

    Parameters
    ----------
    px_per_mm : float
        Pixels to the millimetre; positive.
    """

    px_per_mm: float

    def __post_init__(self) -> None:
        """Refuse what cannot be a scale."""
        if not self.px_per_mm > 0:
            raise ValueError(f"px_per_mm must be positive, but is {self.px_per_mm}.")
