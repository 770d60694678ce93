"""Recipe step: move to a position."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, frames_of
from fingervision.testbed.run.motion_segments import Go

KEYS = ("to_mm", "speed_mm_s", "frames")


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield one motion; a requested number of frames is recorded at its end."""
    yield Go(section.number("to_mm"), section.number("speed_mm_s", above=0.0), frames_of(section)), "to_mm"
