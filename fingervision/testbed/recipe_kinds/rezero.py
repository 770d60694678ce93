"""Reference the stage anew."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.legs import Rezero
from fingervision.testbed.recipe_kinds import Asked

KEYS = ()


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Once; a new run begins with it."""
    yield Rezero(), "kind"
