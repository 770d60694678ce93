"""Kinds of recipe steps, one per module: the record `Step` declares the keys, and `acts` returns the actions."""

import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Protocol

from fingervision.domain.field import Field, declared
from fingervision.storage.toml_section import Section
from fingervision.testbed.run.motion_segments import Act

CONTINUOUS = "continuous"
Asked = tuple[Act, str]
"""An action, and the setting of the recipe from which it follows."""
From = Annotated[float, Field("position to which the stage moves first, if it stands elsewhere", "mm")]
To = Annotated[float, Field("position at which the motion ends", "mm")]
Speed = Annotated[float, Field("speed of the motion", "mm/s", above=0.0)]
Frames = Annotated[
    int | None,
    Field(
        f'`"{CONTINUOUS}"`, or a number of frames to record at each point, once the picture is still', low=1, high=10000
    ),
]
"""Number of frames at each point; None, which a recipe states by a word, records every frame."""


class StepKind(Protocol):
    """Record of a kind of recipe step: its fields are the keys, its docstring says what the test bed does."""

    def acts(self, section: Section, at_mm: float) -> Iterator[Asked]:
        """Actions of the test bed for a recipe step that starts at a given position of the stage."""
        ...


def step_kinds() -> dict[str, type[StepKind]]:
    """The records of all kinds by their names, sorted."""
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return {name: importlib.import_module(f"{__name__}.{name}").Step for name in names}


def step_of(section: Section) -> StepKind:
    """Read a step of a recipe.

    Raises
    ------
    DataError
        The kind is unknown, or its keys are not those that it declares.
    """
    kinds = step_kinds()
    kind, frames = kinds[section.word("kind", of=kinds)], section.values.get("frames", CONTINUOUS)
    if isinstance(frames, str) and frames != CONTINUOUS:
        section.refuse("frames", f'must be "{CONTINUOUS}" or a number of frames for each point, but is {frames!r}.')
    beside = {"kind"} | ({"frames"} if frames == CONTINUOUS else set())
    keys = {key: value for key, value in section.values.items() if key not in beside}
    return replace(section, values=keys).record(kind)


def words_of(kind: type[StepKind]) -> str:
    """What the test bed does in a step of a kind, as a sentence."""
    return (kind.__doc__ or "").partition("\n")[0]


def described(name: str) -> str:
    """The keys of a kind of step with their units, limits and meanings, one in a line."""
    lines = [f"{name}: {words_of(step_kinds()[name])}"]
    for each in declared(step_kinds()[name]):
        unit = f" ({each.field.unit})" if each.field.unit else ""
        may = "" if each.is_required else "optional: "
        lines.append(f"  {each.name:14} {may}{each.field.meaning.replace('`', '')}{unit}")
    return "\n".join(lines)
