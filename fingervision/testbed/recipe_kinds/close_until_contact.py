"""Recipe step: close until the fingers meet an object or each other, with a force limit."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked
from fingervision.testbed.run.motion_segments import Close

KEYS = ("speed_mm_s", "below_force_n")


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield one motion, which ends when force or picture shows contact."""
    speed, force_n = section.number("speed_mm_s", above=0.0), section.number("below_force_n", above=0.0)
    yield Close(speed, force_n), "below_force_n"
