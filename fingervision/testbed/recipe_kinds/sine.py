"""Recipe step: move sinusoidally about a mean position."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import CONTINUOUS, Asked, frames_of
from fingervision.testbed.run.motion_segments import Go, Swing

KEYS = ("mean_mm", "amplitude_mm", "frequency_hz", "cycles", "frames")
# The stage moves to the mean position at the highest speed of the sine, but at least at this speed.
SLOWEST_APPROACH_MM_S = 0.05


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield a move to the mean position, then an oscillation."""
    mean_mm, amplitude_mm = section.number("mean_mm"), section.number("amplitude_mm", above=0.0)
    frequency_hz = section.number("frequency_hz", above=0.0, high=10.0)
    cycles = section.number("cycles", 1.0, above=0.0)
    if frames_of(section) is not None:
        section.refuse("frames", f'must be "{CONTINUOUS}" for a sine, which has no points of rest.')
    swing = Swing(mean_mm, amplitude_mm, frequency_hz, cycles)
    if at_mm != mean_mm:
        yield Go(mean_mm, max(fastest_mm_s(swing), SLOWEST_APPROACH_MM_S)), "mean_mm"
    yield swing, "amplitude_mm"


def fastest_mm_s(swing: Swing) -> float:
    """Highest speed, at the mean position: 2 pi times frequency times amplitude (mm/s)."""
    return 6.283185307179586 * swing.frequency_hz * swing.amplitude_mm
