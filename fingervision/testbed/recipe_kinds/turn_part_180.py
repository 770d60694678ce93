"""Recipe step: the operator turns the part by 180 degrees in the picture."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked
from fingervision.testbed.run.motion_segments import Turn

KEYS = ()


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield one action, which begins a new run."""
    yield Turn(), "kind"
