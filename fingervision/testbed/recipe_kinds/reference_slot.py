"""Recipe step: measure a slot of known width that the operator puts in the gripper's place."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked
from fingervision.testbed.run.motion_segments import Slot

KEYS = ("size_mm", "u_size_mm")


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield one action: the slot is inserted, measured and removed."""
    yield Slot(section.number("size_mm", above=0.0), section.number("u_size_mm", 0.0, low=0.0)), "size_mm"
