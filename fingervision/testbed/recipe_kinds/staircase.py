"""Recipe step: move in equal increments from one position to another, with a dwell at each level."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, frames_of
from fingervision.testbed.run.motion_segments import Go, Stand

KEYS = ("from_mm", "to_mm", "steps", "dwell_s", "speed_mm_s", "frames")


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield one motion and dwell after another, including those at the first and the last level."""
    from_mm, to_mm = section.number("from_mm"), section.number("to_mm")
    steps, dwell_s = section.whole("steps", low=1, high=10000), section.number("dwell_s", 0.0, low=0.0)
    speed, frames = section.number("speed_mm_s", above=0.0), frames_of(section)
    if from_mm == to_mm:
        section.refuse("to_mm", f"must differ from from_mm, but both are {to_mm:g}.")
    for k in range(steps + 1):
        level_mm = from_mm + (to_mm - from_mm) * k / steps
        if k > 0 or at_mm != from_mm:
            # If a number of frames is stated, these frames are recorded on the level; the motion to the level is not
            # recorded.
            yield Go(level_mm, speed, None if frames is None else 0), "to_mm" if k == steps else "from_mm"
        yield Stand(dwell_s, frames), "dwell_s"
