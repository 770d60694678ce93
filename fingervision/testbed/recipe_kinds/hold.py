"""Recipe step: move to a position and stay there for a time."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, frames_of
from fingervision.testbed.run.motion_segments import Go, Stand

KEYS = ("at_mm", "seconds", "frames")
# Speed of the motion to the position, because a hold states no speed: slow enough for a webcam.
APPROACH_MM_S = 0.5


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Move to the position if the stage is elsewhere, then rest there."""
    hold_mm, seconds, frames = section.number("at_mm"), section.number("seconds", above=0.0), frames_of(section)
    if at_mm != hold_mm:
        yield Go(hold_mm, APPROACH_MM_S, None if frames is None else 0), "at_mm"
    yield Stand(seconds, frames), "seconds"
