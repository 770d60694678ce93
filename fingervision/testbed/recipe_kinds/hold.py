"""Recipe step: move to a position and stay there for a time."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Frames, From, Go, Stand

# Speed of the motion to the position, because a hold states no speed: slow enough for a webcam.
APPROACH_MM_S = 0.5


@dataclass(frozen=True, slots=True)
class Step:
    """Move to a position and stay there for a time."""

    at_mm: From
    seconds: Annotated[float, Field("length of the hold", "s", above=0.0)]
    frames: Frames = None

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Move to the position if the stage is elsewhere, then rest there."""
        if at_mm != self.at_mm:
            yield Go(self.at_mm, APPROACH_MM_S, None if self.frames is None else 0), "at_mm"
        yield Stand(self.seconds, self.frames), "seconds"
