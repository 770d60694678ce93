"""Kinds of recipe steps, one per file: `KEYS` and `acts(section, at_mm)`, which returns the bed's actions."""

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Protocol

from fingervision.storage.toml_section import Section
from fingervision.testbed.run.motion_segments import Act, Frames

CONTINUOUS = "continuous"
MOST_FRAMES = 10000
Asked = tuple[Act, str]
"""What to do, and the key that it follows from."""


class StepKind(Protocol):
    """Protocol of a module that defines a kind of recipe step."""

    KEYS: tuple[str, ...]

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Actions of the bed for a step that begins at a given position."""
        ...


def step_kinds() -> tuple[str, ...]:
    """Names of the kinds, sorted."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def kind_of(section: Section) -> StepKind:
    """Find the kind of a step, and refuse keys that the kind does not know."""
    name = section.word("kind", of=step_kinds())
    kind: StepKind = importlib.import_module(f"{__name__}.{name}")
    section.only(("kind", *kind.KEYS))
    return kind


def frames_of(section: Section) -> Frames:
    """Read `frames`: the word continuous, or a number per point."""
    value = section.values.get("frames", CONTINUOUS)
    if value == CONTINUOUS:
        return None
    if isinstance(value, str):
        section.refuse("frames", f'must be "{CONTINUOUS}" or a number for each point, but is {value!r}.')
    return section.whole("frames", low=1, high=MOST_FRAMES)
