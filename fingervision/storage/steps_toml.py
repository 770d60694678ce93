"""The file steps.toml: step data of a motor controller.

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

from collections.abc import Mapping
from pathlib import Path

from fingervision.domain.errors import DataError, OutputError
from fingervision.domain.step_data import MOST_STEPS, Coordinates, CycleTime, Operation, SpeedEntry, Step, StepData
from fingervision.storage.toml_section import Section, read_document

SCHEMA = 1
_SPEED_KEYS = ("speed_mm_s", "acceleration_mm_s2", "deceleration_mm_s2")
_STEP_KEYS = (
    "number", "target_mm", "coordinates", "operation", "pushing_force_n", "load_kg", "positioning_time_s", *_SPEED_KEYS,
)  # fmt: skip


def read_steps(path: Path) -> StepData:
    """Read step data.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or a value in it is not allowed; the message names the line.
    """
    values, text = read_document(path, "step data")
    top = Section(path, text, "", values)
    top.only(("schema", "name", "start_mm", "sequence", "step"))
    schema = top.whole("schema", low=1)
    if schema != SCHEMA:
        top.refuse("schema", f"must be {SCHEMA}, but is {schema}: this program is older than the file.")
    sections = top.tables("step")
    if not 1 <= len(sections) <= MOST_STEPS:
        raise DataError(
            f"{path} must hold 1 to {MOST_STEPS} tables [[step]], which is how many the controller stores, "
            f"but holds {len(sections)}."
        )
    steps: dict[int, Step] = {}
    for section in sections:
        number = section.whole("number", max(steps, default=0) + 1, low=1, high=MOST_STEPS)
        if number in steps:
            section.refuse("number", f"must differ from the numbers of all earlier steps, but {number} occurs twice.")
        steps[number] = _step(section)
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


def _step(section: Section) -> Step:
    section.only(_STEP_KEYS)
    operation = Operation(section.word("operation", Operation.MOVING.value, of=[each.value for each in Operation]))
    if operation is Operation.MOVING and "pushing_force_n" in section.values:
        section.refuse("pushing_force_n", 'must come with operation = "pushing", but the operation is moving.')
    pushing = operation is Operation.PUSHING
    return Step(
        target_mm=section.number("target_mm"),
        load_kg=section.number("load_kg", above=0.0),
        entry=_entry(section),
        coordinates=Coordinates(
            section.word("coordinates", Coordinates.ABSOLUTE.value, of=[each.value for each in Coordinates])
        ),
        operation=operation,
        pushing_force_n=section.number("pushing_force_n", above=0.0) if pushing else None,
    )


def _entry(section: Section) -> CycleTime | SpeedEntry:
    timed = "positioning_time_s" in section.values
    speeds = [key for key in _SPEED_KEYS if key in section.values]
    if timed and speeds:
        section.refuse(
            speeds[0],
            "must not be given together with positioning_time_s, which determines it: leave one of the two out.",
        )
    if timed:
        return CycleTime(section.number("positioning_time_s", above=0.0))
    if not speeds:
        section.refuse(None, f"must state positioning_time_s, or {', '.join(_SPEED_KEYS)}, but states neither.")
    return SpeedEntry(*(section.number(key, above=0.0) for key in _SPEED_KEYS))


def write_steps(path: Path, data: StepData) -> None:
    """Write step data to a file, from which they can be read back exactly."""
    lines = [
        f"schema = {SCHEMA}", f"name = {_text(data.name)}", f"start_mm = {data.start_mm!r}",
        f"sequence = {list(data.sequence)}",
    ]  # fmt: skip
    for number, step in sorted(data.steps.items()):
        lines += [
            "", "[[step]]", f"number = {number}", f"target_mm = {step.target_mm!r}",
            f'coordinates = "{step.coordinates}"', f'operation = "{step.operation}"',
        ]  # fmt: skip
        if step.pushing_force_n is not None:
            lines.append(f"pushing_force_n = {step.pushing_force_n!r}")
        lines.append(f"load_kg = {step.load_kg!r}")
        if isinstance(step.entry, CycleTime):
            lines.append(f"positioning_time_s = {step.entry.positioning_time_s!r}")
        else:
            lines += [f"{key} = {getattr(step.entry, key)!r}" for key in _SPEED_KEYS]
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(
            f"The step data of the motor controller could not be written to {path} ({error.strerror})."
        ) from error


def _text(words: str) -> str:
    """Quote a text for TOML with JSON escapes, which are valid in TOML except for the control character DEL."""
    import json

    return json.dumps(words, ensure_ascii=False).replace("\x7f", "\\u007f")
