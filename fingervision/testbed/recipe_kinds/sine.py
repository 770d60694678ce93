"""Recipe step: move sinusoidally about a mean position; every frame is recorded."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, From, Go, Swing

# The stage moves to the mean position at the highest speed of the sine, but at least at this speed.
SLOWEST_APPROACH_MM_S = 0.05


@dataclass(frozen=True, slots=True)
class Step:
    """Move sinusoidally about a mean position; every frame is recorded."""

    mean_mm: From
    amplitude_mm: Annotated[float, Field("amplitude of the sine", "mm", above=0.0)]
    frequency_hz: Annotated[float, Field("frequency of the sine, at most 10", "Hz", above=0.0, high=10.0)]
    cycles: Annotated[float, Field("number of periods; 1 if not given", above=0.0)] = 1.0

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield a move to the mean position, then an oscillation."""
        swing = Swing(self.mean_mm, self.amplitude_mm, self.frequency_hz, self.cycles)
        if at_mm != self.mean_mm:
            yield Go(self.mean_mm, max(fastest_mm_s(swing), SLOWEST_APPROACH_MM_S)), "mean_mm"
        yield swing, "amplitude_mm"


def fastest_mm_s(swing: Swing) -> float:
    """Highest speed, at the mean position: 2 pi times frequency times amplitude (mm/s)."""
    return 6.283185307179586 * swing.frequency_hz * swing.amplitude_mm
