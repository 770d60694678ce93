"""Shift the picture, so that the fingers stand elsewhere in it."""

from collections.abc import Iterator

from fingervision.storage.toml_section import Section
from fingervision.testbed.recipe_kinds import Asked
from fingervision.testbed.run.motion_segments import Shift

KEYS = ()


def acts(section: Section, at_mm: float) -> Iterator[Asked]:
    """Once; a new run begins with it."""
    yield Shift(), "kind"
