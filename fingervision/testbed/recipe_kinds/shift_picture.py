"""Recipe step: the operator shifts the camera, so that the fingers appear elsewhere in the picture."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked
from fingervision.testbed.run.motion_segments import Shift

KEYS = ()


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Yield one action, which begins a new run."""
    yield Shift(), "kind"
