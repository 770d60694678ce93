"""Kinds of recipe steps, one per module, each with `KEYS` and `acts(section, at_mm)`, which returns actions."""

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Protocol

from fingervision.storage.toml_section import Section
from fingervision.testbed.run.motion_segments import Act, Frames

CONTINUOUS = "continuous"
MOST_FRAMES = 10000
Asked = tuple[Act, str]
"""An action, and the setting of the recipe from which it follows."""


class StepKind(Protocol):
    """Protocol of a module that defines a kind of recipe step."""

    KEYS: tuple[str, ...]

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Actions of the test bed for a recipe step that starts at a given position of the stage."""
        ...


def step_kinds() -> tuple[str, ...]:
    """Names of the kinds, sorted."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def kind_of(section: Section) -> StepKind:
    """Find the kind of a step, and refuse settings that the kind does not have."""
    name = section.word("kind", of=step_kinds())
    kind: StepKind = importlib.import_module(f"{__name__}.{name}")
    section.only(("kind", *kind.KEYS))
    return kind


def frames_of(section: Section) -> Frames:
    """Read `frames`: the word `continuous`, or a number of frames per point."""
    value = section.values.get("frames", CONTINUOUS)
    if value == CONTINUOUS:
        return None
    if isinstance(value, str):
        section.refuse("frames", f'must be "{CONTINUOUS}" or a number of frames for each point, but is {value!r}.')
    return section.whole("frames", low=1, high=MOST_FRAMES)
