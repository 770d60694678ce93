"""The files recipe.toml, steps of the test bed, and steps.toml, step data of a motor controller.

schema = 1
name = "open and push"
start_mm = 0.0                       # position before the first block; 0 if not given
sequence = [1, 2, 2]                 # order of execution; if not given, each block once, by number
[[step]]                             # block 1; a key such as `number = 3` sets another number
target_mm = 5.0
coordinates = "absolute"             # or "relative"; absolute if not given
operation = "moving"                 # or "pushing", with pushing_force_n; moving if not given
load_kg = 0.2
positioning_time_s = 0.2             # cycle-time entry
[[step]]
target_mm = 0.5
coordinates = "relative"
load_kg = 0.2
speed_mm_s = 20.0                    # speed entry
acceleration_mm_s2 = 1000.0
deceleration_mm_s2 = 500.0
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from fingervision.domain.errors import DataError
from fingervision.domain.field import Field, names_of
from fingervision.domain.recipe import Recipe
from fingervision.domain.step_data import MOST_STEPS, Coordinates, CycleTime, Operation, SpeedEntry, Step, StepData
from fingervision.storage.durable import written
from fingervision.storage.plain_file import toml_lines
from fingervision.storage.toml_section import Section, read_section

SCHEMA = 1


@dataclass(frozen=True, slots=True)
class StepTable:
    """A table [[step]] as it stands in the file."""

    target_mm: Annotated[float, Field("position, or displacement if the coordinates are relative", "mm")]
    load_kg: Annotated[float, Field("moved mass", "kg", above=0.0)]
    number: Annotated[int | None, Field("number of the block; the next one by default", low=1, high=MOST_STEPS)] = None
    coordinates: Annotated[Coordinates, Field("`absolute` or `relative`; absolute by default")] = Coordinates.ABSOLUTE
    operation: Annotated[Operation, Field("`moving`, or `pushing` with `pushing_force_n`; moving by default")] = (
        Operation.MOVING
    )
    pushing_force_n: Annotated[float | None, Field("force of pushing", "N", above=0.0)] = None
    positioning_time_s: Annotated[
        float | None, Field("cycle-time entry: time from the start of the motion to rest", "s", above=0.0)
    ] = None
    speed_mm_s: Annotated[float | None, Field("speed entry: constant speed", "mm/s", above=0.0)] = None
    acceleration_mm_s2: Annotated[float | None, Field("speed entry: accelerations", "mm/s2", above=0.0)] = None
    deceleration_mm_s2: Annotated[float | None, Field("speed entry: accelerations", "mm/s2", above=0.0)] = None


_SPEED_KEYS = names_of(SpeedEntry)


def read_steps(path: Path) -> StepData:
    """Read step data.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or a value in it is not allowed; the message names the line.
    """
    top = read_section(path, "step data", ("name", "start_mm", "sequence", "step"), SCHEMA)
    sections = top.tables("step")
    if not 1 <= len(sections) <= MOST_STEPS:
        raise DataError(
            f"{path} must hold 1 to {MOST_STEPS} tables [[step]], which is how many the controller stores, "
            f"but holds {len(sections)}."
        )
    steps: dict[int, Step] = {}
    for section in sections:
        table = section.record(StepTable)
        number = table.number or max(steps, default=0) + 1
        if number in steps:
            section.refuse("number", f"must differ from the numbers of all earlier steps, but {number} occurs twice.")
        if number > MOST_STEPS:
            section.refuse("number", f"must be at most {MOST_STEPS}, but is {number}.")
        steps[number] = _step(section, table)
    return StepData(
        name=top.word("name", path.stem),
        steps=dict(sorted(steps.items())),
        sequence=_sequence(top, steps),
        start_mm=top.number("start_mm", 0.0),
    )


def _sequence(top: Section, steps: Mapping[int, Step]) -> tuple[int, ...]:
    raw = top.values.get("sequence", sorted(steps))
    if not isinstance(raw, list) or not all(isinstance(each, int) and each in steps for each in raw):
        known = ", ".join(str(number) for number in sorted(steps))
        top.refuse("sequence", f"must be a list of the numbers of existing steps ({known}), but is {raw!r}.")
    return tuple(raw)


def _step(section: Section, table: StepTable) -> Step:
    pushing = table.operation is Operation.PUSHING
    if not pushing and table.pushing_force_n is not None:
        section.refuse("pushing_force_n", 'must come with operation = "pushing", but the operation is moving.')
    if pushing and table.pushing_force_n is None:
        section.refuse(None, "must state pushing_force_n, but does not: add it.")
    return Step(
        table.target_mm, table.load_kg, _entry(section, table), table.coordinates, table.operation,
        table.pushing_force_n,
    )  # fmt: skip


def _entry(section: Section, table: StepTable) -> CycleTime | SpeedEntry:
    speeds = {key: getattr(table, key) for key in _SPEED_KEYS if getattr(table, key) is not None}
    if table.positioning_time_s is not None and speeds:
        section.refuse(
            next(iter(speeds)),
            "must not be given together with positioning_time_s, which determines it: leave one of the two out.",
        )
    if table.positioning_time_s is not None:
        return CycleTime(table.positioning_time_s)
    missing = [key for key in _SPEED_KEYS if key not in speeds]
    if not speeds:
        section.refuse(None, f"must state positioning_time_s, or {', '.join(_SPEED_KEYS)}, but states neither.")
    if missing:
        section.refuse(None, f"must state {missing[0]}, but does not: add it.")
    return SpeedEntry(**speeds)


def write_steps(path: Path, data: StepData) -> None:
    """Write step data to a file, from which they can be read back exactly."""
    top = {"schema": SCHEMA, "name": data.name, "start_mm": data.start_mm, "sequence": data.sequence}
    lines = toml_lines(top)
    for number, step in sorted(data.steps.items()):
        stated = {
            "number": number, "target_mm": step.target_mm, "coordinates": step.coordinates,
            "operation": step.operation, "pushing_force_n": step.pushing_force_n, "load_kg": step.load_kg,
        }  # fmt: skip
        lines += toml_lines(stated | asdict(step.entry), "[[step]]")
    with written(path, "name another file") as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


# The file recipe.toml: the steps that the test bed executes.

BELOW_FORCE_N = 5.0


def read_recipe(path: Path) -> Recipe[Section]:
    """Read a recipe; the settings of each step are read by the step's kind.

    Raises
    ------
    DataError, InputFileError
        The file does not exist, is not TOML, has a newer schema, has no step, or has an unknown key.
    """
    top = read_section(path, "recipe", ("name", "below_force_n", "step"), SCHEMA)
    steps = top.tables("step")
    if not steps:
        top.refuse(None, "must have at least one [[step]], but has none: add one with its kind.")
    below_force_n = top.number("below_force_n", BELOW_FORCE_N, above=0.0)
    return Recipe(top.word("name", path.stem), below_force_n, steps, top.text)


def write_recipe(
    path: Path, name: str, steps: Sequence[Mapping[str, object]], below_force_n: float = BELOW_FORCE_N
) -> None:
    """Write a recipe with the given steps."""
    lines = toml_lines({"schema": SCHEMA, "name": name, "below_force_n": below_force_n})
    for step in steps:
        lines += toml_lines(step, "[[step]]")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
