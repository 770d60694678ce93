"""Recipe step: move to a position and back at constant speed."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, frames_of
from fingervision.testbed.run.motion_segments import Go

KEYS = ("from_mm", "to_mm", "speed_mm_s", "cycles", "frames")


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield a move to the first position if the stage is elsewhere, then out and back for each cycle."""
    from_mm, to_mm = section.number("from_mm"), section.number("to_mm")
    speed, frames = section.number("speed_mm_s", above=0.0), frames_of(section)
    if from_mm == to_mm:
        section.refuse("to_mm", f"must differ from from_mm, but both are {to_mm:g}.")
    if at_mm != from_mm:
        yield Go(from_mm, speed, frames), "from_mm"
    for _ in range(section.whole("cycles", 1, low=1)):
        yield Go(to_mm, speed, frames), "to_mm"
        yield Go(from_mm, speed, frames), "from_mm"
