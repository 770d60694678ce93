"""Recipe step: ask the operator to turn the part by 180 degrees in the picture; a new run begins."""

from collections.abc import Iterator
from dataclasses import dataclass

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Turn


@dataclass(frozen=True, slots=True)
class Step:
    """Ask the operator to turn the part by 180 degrees in the picture; a new run begins."""

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield one action, which begins a new run."""
        yield Turn(), "kind"
