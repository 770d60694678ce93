"""Recipe step: move to a position and back at constant speed."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Frames, From, Go, Speed, To


@dataclass(frozen=True, slots=True)
class Step:
    """Move to a position and back at constant speed."""

    from_mm: From
    to_mm: To
    speed_mm_s: Speed
    cycles: Annotated[int, Field("number of motions there and back; 1 if not given", low=1, high=1_000_000)] = 1
    frames: Frames = None

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield a move to the first position if the stage is elsewhere, then out and back for each cycle."""
        if self.from_mm == self.to_mm:
            section.refuse("to_mm", f"must differ from from_mm, but both are {self.to_mm:g}.")
        if at_mm != self.from_mm:
            yield Go(self.from_mm, self.speed_mm_s, self.frames), "from_mm"
        for _ in range(self.cycles):
            yield Go(self.to_mm, self.speed_mm_s, self.frames), "to_mm"
            yield Go(self.from_mm, self.speed_mm_s, self.frames), "from_mm"
