"""Recipe step: search the reference of the stage again, which sets position 0; a new run begins."""

from collections.abc import Iterator
from dataclasses import dataclass

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked, Rezero


@dataclass(frozen=True, slots=True)
class Step:
    """Search the reference of the stage again, which sets position 0; a new run begins."""

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Yield one action, which begins a new run."""
        yield Rezero(), "kind"
