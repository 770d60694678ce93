"""Recipe step: close until the fingers meet an object or each other, with a force limit."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Close, Speed


@dataclass(frozen=True, slots=True)
class Step:
    """Close until the fingers meet an object or each other, with a force limit."""

    speed_mm_s: Speed
    below_force_n: Annotated[float, Field("force at which the step ends", "N", above=0.0)]

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield one motion, which ends when force or picture shows contact."""
        yield Close(self.speed_mm_s, self.below_force_n), "below_force_n"
