"""Recipe step: measure a slot of known width that the operator puts in the gripper's place."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Slot


@dataclass(frozen=True, slots=True)
class Step:
    """Measure a slot of known width that the operator puts in the gripper's place."""

    size_mm: Annotated[float, Field("width of the slot that the operator puts in the gripper's place", "mm", above=0.0)]
    u_size_mm: Annotated[float, Field("standard uncertainty of this width", "mm", low=0.0)] = 0.0

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield one action: the slot is inserted, measured and removed."""
        yield Slot(self.size_mm, self.u_size_mm), "size_mm"
