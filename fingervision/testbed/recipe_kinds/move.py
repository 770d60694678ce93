"""Recipe step: move to a position."""

from collections.abc import Iterator
from dataclasses import dataclass

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Frames, Go, Speed, To


@dataclass(frozen=True, slots=True)
class Step:
    """Move to a position."""

    to_mm: To
    speed_mm_s: Speed
    frames: Frames = None

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield one motion; a requested number of frames is recorded at its end."""
        yield Go(self.to_mm, self.speed_mm_s, self.frames), "to_mm"
