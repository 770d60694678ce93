"""Recipe step: move in equal increments from one position to another, with a dwell at each level."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Frames, From, Go, Speed, Stand, To


@dataclass(frozen=True, slots=True)
class Step:
    """Move in equal increments from one position to another, with a dwell at each level."""

    from_mm: From
    to_mm: To
    steps: Annotated[int, Field("number of intervals of the staircase", low=1, high=10000)]
    speed_mm_s: Speed
    dwell_s: Annotated[float, Field("time at each level", "s", low=0.0)] = 0.0
    frames: Frames = None

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield one motion and dwell after another, including those at the first and the last level."""
        if self.from_mm == self.to_mm:
            section.refuse("to_mm", f"must differ from from_mm, but both are {self.to_mm:g}.")
        for k in range(self.steps + 1):
            level_mm = self.from_mm + (self.to_mm - self.from_mm) * k / self.steps
            if k > 0 or at_mm != self.from_mm:
                # If a number of frames is stated, these frames are recorded on the level; the motion to the level is
                # not recorded.
                frames = None if self.frames is None else 0
                yield Go(level_mm, self.speed_mm_s, frames), "to_mm" if k == self.steps else "from_mm"
            yield Stand(self.dwell_s, self.frames), "dwell_s"
