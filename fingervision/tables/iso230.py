"""Tables of targets, cycles and directions (ISO 230-2), converted to a measured table in the order of travel.

Long form, one row per reading: a target, a cycle, a direction and a position or a deviation, with a time, run and
uncertainty where there are. Matrix form, one row per target: a column for each cycle and direction such as
`up_1_deviation_um`, or for each cycle (`cycle_1_position_mm`) beside a column of directions.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.storage.csv_columns import Numbers
from fingervision.storage.measured_table import measured_rows
from fingervision.tables.dialect import to_numbers
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError, Question
from fingervision.tables.raw_table import RawTable
from fingervision.tables.times import looks_like_time, seconds_of
from fingervision.tables.units import ColumnName, column_name, factor
from fingervision.tables.words import FILLERS, tokens

KIND = "measured"
OWN_TARGET, OWN_INPUT = "target_mm", "input_mm"
"""Column of targets in fingervision's own tables, and that of the input in tables that hold no targets and cycles."""
FROM_BELOW = (
    "+ +1 1 up u forward forwards fwd positive pos increasing ascending rising auf aufwarts vorwarts vor hin positiv "
    "avant aller montee positif ida adelante positivo andata avanti salita"
)
FROM_ABOVE = (
    "- -1 down d backward backwards bwd reverse rev negative neg decreasing descending falling ab abwarts ruckwarts "
    "zuruck negativ arriere retour descente negatif vuelta atras negativo ritorno indietro"
)
SIDES = dict.fromkeys(FROM_BELOW.split(), 1) | dict.fromkeys(FROM_ABOVE.split(), -1)
"""Words for directions, without accents: 1 from below, -1 from above."""
FORWARD = {"forward", "forwards", "fwd"}
"""Ambiguous words for a direction: some authors mean along the axis, others towards its zero."""
OWN_BLOCK = re.compile(r"(.+_(?:position|deviation))_(mm|um)")
"""Name of a column of readings in fingervision's own tables."""
CYCLES = frozenset(["cycle", "zyklus", "ciclo", "lauf", "run", "messreihe", "serie", "reihe", "i", "j"])
ARROWS = {"\u2191": " up ", "\u2193": " down ", "\u2192": " up ", "\u2190": " down ", "\N{MINUS SIGN}": "-"}
POSITIONS = ("position", "posicion", "posizione", "istposition")
DEVIATIONS = ("deviation", "abweichung", "desviacion", "scostamento", "ecart", "error", "fehler")
SMALLEST_TRAVEL = 0.05
"""Ratio of the range of positions to the range of targets below which the positions must be mislabelled deviations."""
LARGEST_DEVIATION = 0.5
"""Ratio of the range of deviations to the range of targets above which the deviations must be mislabelled positions,
because no axis has an error of half its travel."""

NOMINAL_S = 30.0
"""Assumed time between rows of a table without times. In a published log of a stage measured with a laser, the time
between readings (move, settle, average) is 28.5 s. Effects with time constants of a second or less are then correctly
treated as invisible."""
SWAPPED = 0.75
"""Fraction of the moves between targets that contradict the stated direction, above which the directions are considered
as interchanged. With correct directions, only the return moves of one-directional cycles contradict, one move in each
cycle."""
LONGEST_OVERSHOOT_MM = 0.5
"""Longest assumed overshoot beyond a target: the largest play in the catalogue of effects. The overshoot is shorter if
the targets are closer together, so that it does not pass a neighbouring target."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One reading at a target: position (None if missing), direction (+1 from below, -1 from above), cycle, time.

    A reading without a position is only a point on the path of the input.
    """

    target_mm: float
    position_mm: float | None
    side: int
    cycle: int
    run: str = ""
    time_s: float | None = None
    u_random_mm: float | None = None


def approach_path(readings: Sequence[Reading]) -> tuple[tuple[Reading, ...], tuple[str, ...]]:
    """Sort readings in the order of travel, and add one beyond a target wherever the axis must have overshot it.

    Parameters
    ----------
    readings : sequence of Reading
        Readings in any order; each target occurs once per run, cycle and direction.

    Returns
    -------
    rows : tuple of Reading
        Readings, run after run, with increasing times within each run.
    notes : tuple of str
        Assumptions that were made, one sentence each.
    """
    timed = all(reading.time_s is not None for reading in readings)
    notes = []
    against, moves = _against(
        sorted(readings, key=lambda reading: (reading.run, _time(reading)) if timed else ("", 0.0))
    )
    if against > SWAPPED * moves:
        came = f"{against} of {moves} moves from target to target go against the stated direction"
        if timed:
            readings = [replace(reading, side=-reading.side) for reading in readings]
            notes.append(f"According to the times, {came}: the two directions were exchanged.")
        elif len({reading.side for reading in readings}) > 1:
            # A table with a single direction of approach may be sorted by its targets.
            notes.append(f"In the order of the rows, {came}: are the two directions exchanged in the table?")
    targets = np.unique([reading.target_mm for reading in readings])
    closest = float(np.min(np.diff(targets))) if targets.size > 1 else LONGEST_OVERSHOOT_MM
    beyond = min(LONGEST_OVERSHOOT_MM, closest)
    rows: list[Reading] = []
    for run in dict.fromkeys(reading.run for reading in readings):
        mine = [reading for reading in readings if reading.run == run]
        rows += _with_overshoots(sorted(mine, key=_time if timed else _travel), beyond, timed)
    added = len(rows) - len(readings)
    if not timed:
        notes.append(
            "The table has no times: within a cycle, targets approached from below were taken in ascending order, then "
            f"those from above in descending order, one row every {NOMINAL_S:g} s. Rates and time constants of the "
            f"report refer to these assumed times."
        )
    if added:
        notes.append(
            f"{added} rows without a gap were added {beyond:g} mm beyond a target, because the stated side of "
            f"approach means that the stage came from there."
        )
    return tuple(rows), tuple(notes)


def _against(ordered: Sequence[Reading]) -> tuple[int, int]:
    """Number of moves between targets that contradict the stated direction of approach, and total number of moves."""
    moves = [(b.target_mm - a.target_mm) * b.side for a, b in pairwise(ordered) if a.run == b.run]
    return sum(move < 0.0 for move in moves), sum(move != 0.0 for move in moves)


def _time(reading: Reading) -> float:
    return 0.0 if reading.time_s is None else reading.time_s


def _travel(reading: Reading) -> tuple[int, int, float]:
    """Sort key: cycle, then approaches from below before those from above, then the direction of travel."""
    return reading.cycle, -reading.side, reading.side * reading.target_mm


def _with_overshoots(ordered: Sequence[Reading], beyond: float, timed: bool) -> list[Reading]:
    """Readings of a run with their overshoots; each of these has the mean time of its neighbours."""
    path: list[Reading] = []
    clock = [_time(reading) for reading in ordered]
    usual_s = float(np.median(np.diff(clock))) if timed and len(clock) > 1 else NOMINAL_S
    for reading, time_s in zip(ordered, clock, strict=True):
        if not path or reading.side * (reading.target_mm - path[-1].target_mm) <= 0.0:
            turned_s = (_time(path[-1]) + time_s) / 2.0 if path else time_s - usual_s / 2.0
            turned_mm = reading.target_mm - reading.side * beyond
            path.append(Reading(turned_mm, None, reading.side, reading.cycle, reading.run, turned_s))
        path.append(reading)
    return path if timed else [replace(row, time_s=NOMINAL_S * k) for k, row in enumerate(path)]


@dataclass(frozen=True, slots=True)
class Iso230Rows:
    """Readings in the order of travel, including those added for overshoots; one sentence for each assumption."""

    rows: tuple[Reading, ...]
    notes: tuple[str, ...]

    def table(self, path: Path, notes: Sequence[str]) -> MeasuredTable:
        """Return the rows as a measured table.

        Raises
        ------
        DataError
            There are too few rows, or the position never changes.
        """
        columns = {
            "input_mm": _numbers([row.target_mm for row in self.rows]),
            "gap_mm": _numbers([row.position_mm for row in self.rows]),
            "time_s": _numbers([row.time_s for row in self.rows]),
        }
        u = _numbers([row.u_random_mm for row in self.rows])
        if u.present.any():
            columns["u_random_mm"] = u
        runs = [row.run for row in self.rows]
        return measured_rows(path, columns, runs if any(runs) else None, (*notes, *self.notes), count_rows=False)


def _numbers(values: Sequence[float | None]) -> Numbers:
    present = np.array([value is not None for value in values], dtype=np.bool_)
    return Numbers(np.array([value or 0.0 for value in values], dtype=np.float64), present)


@dataclass(frozen=True, slots=True)
class _Block:
    """A column of readings.

    Parameters
    ----------
    place : int
        Number of the column.
    side : str
        Word for the direction of all its readings; empty if a column of directions states it.
    cycle : str
        Cycle of all its readings; empty if a column of cycles, or the order of the rows, states it.
    quantity : str
        `position` or `deviation`, if the name states it.
    """

    place: int
    side: str = ""
    cycle: str = ""
    quantity: str = ""


def iso230_rows_of(raw: RawTable, given: Entry) -> Iso230Rows | None:
    """Interpret a raw table of targets, cycles and directions; None for any other table.

    The measured position, or target plus deviation, is taken as the gap. Rows are sorted in the order of travel: by
    their times if every row has one; otherwise cycle by cycle, first the targets approached from below in ascending
    order, then those approached from above in descending order, with one reading every 30 s. If a target could not be
    reached from its stated direction, a row without a gap is added beyond the target.

    Parameters
    ----------
    raw : RawTable
        Raw table from a file of any format.
    given : Entry
        Decisions of the user.

    Raises
    ------
    DataError
        A column is missing, a word is not a direction, a reading occurs twice, or deviations are labelled as positions
        (or positions as deviations).
    OpenQuestionError
        A unit is unknown, or it is unknown whether the readings are positions or deviations.
    """
    names = [_named(column.name) for column in raw.columns]
    targets, directions = (_places(names, role, given) for role in ("target", "direction"))
    if len(targets) != 1 or "input" in given.columns or any(name.text == OWN_INPUT for name in names):
        return None
    blocks = [block for k, name in enumerate(names) if k != targets[0] and (block := _block(k, name)) is not None]
    blocks = [block for block in blocks if block.side] or (blocks if directions else [])
    if not directions and len(blocks) < 2:
        if names[targets[0]].text == OWN_TARGET and not _places(names, "gap", given):
            raise DataError(
                f"{raw.path} must have a column direction (up or down: the side from which the target was approached), "
                f"but has {','.join(name.text for name in names)}: add it; or, if the rows are in the order of travel, "
                "name the columns input_mm and gap_mm."
            )
        return None
    questions: list[Question] = []
    target_mm = _length(raw, names, targets[0], "target", given, questions)
    blocks = blocks or [_Block(_long_form(raw, names, given))]
    quantities = {block.quantity for block in blocks if block.quantity}
    if len(quantities) > 1:
        raise DataError(f"{raw.path} must hold positions or deviations, but has columns of both: remove one of them.")
    quantity = next(iter(quantities), "") or _quantity(raw, names, blocks[0].place, target_mm, given, questions)
    values = [_length(raw, names, block.place, quantity, given, questions) for block in blocks]
    beside = _beside(raw, names, given, questions)
    if questions:
        unique = {question.key: question for question in questions}
        raise OpenQuestionError(raw.path, KIND, list(unique.values()))
    readings = _readings(raw, target_mm, blocks, values, beside, is_relative=quantity == "deviation")
    _check_quantity(raw.path, readings, quantity)
    rows, assumed = approach_path(readings)
    notes = [
        f"Read as an ISO 230-2 table: {len({r.target_mm for r in readings})} targets, "
        f"{len({(r.run, r.cycle) for r in readings})} cycles; input = target, gap = "
        f"{'position' if quantity == 'position' else 'target + deviation'}."
    ]
    said = {_side(word) for word in (*beside.words.get("direction", ()), *(block.side for block in blocks))}
    if said & FORWARD:
        notes.append(
            f"The direction {sorted(said & FORWARD)[0]} was taken as the approach from below (the input increases). "
            f"Some published reports use this word for the approach from above: if the reversal has the wrong sign in "
            f"the result, exchange the directions."
        )
    return Iso230Rows(rows, (*notes, *assumed))


@dataclass(frozen=True, slots=True)
class _Beside:
    """What stands beside the readings: words by role (direction, cycle, run), times and uncertainties."""

    words: Mapping[str, Sequence[str]]
    time_s: Numbers | None
    u_mm: Numbers | None


def _beside(raw: RawTable, names: Sequence[ColumnName], given: Entry, questions: list[Question]) -> _Beside:
    roles = ("direction", "cycle", "run", "time", "u_random")
    places = {role: found[0] for role in roles if len(found := _places(names, role, given)) == 1}
    return _Beside(
        {role: raw.columns[places[role]].words() for role in roles[:3] if role in places},
        _seconds(raw, names, places["time"], given, questions) if "time" in places else None,
        _length(raw, names, places["u_random"], "u_random", given, questions) if "u_random" in places else None,
    )


def _named(text: str) -> ColumnName:
    """Split a column's name into name and unit, also a name such as `up_1_deviation_um` that is no usual name."""
    own = OWN_BLOCK.fullmatch(text.strip())
    return column_name(text) if own is None else ColumnName(text, own[1], own[2])


def _places(names: Sequence[ColumnName], role: str, given: Entry) -> list[int]:
    """Indices of the columns with a role: the column that the user names, otherwise those recognised by name."""
    stated = given.columns.get(role)
    if stated is not None:
        found = [k for k, name in enumerate(names) if stated in (name.text, name.base, str(k + 1))]
        if len(found) != 1:
            raise DataError(
                f"columns.{role} of {given.source} must name a column ({', '.join(n.text for n in names)}), but is "
                f"{stated}: correct it."
            )
        return found
    return [k for k, name in enumerate(names) if name.role == role]


def _side(word: str) -> str:
    """Spell a word for a direction as in `SIDES`; unknown words are kept, and refused later."""
    for arrow, side in ARROWS.items():
        word = word.replace(arrow, side)
    plain = word.strip().lower()
    signed = re.sub(r"^([+-]?1)\.0*$", r"\1", plain)
    return signed if signed in SIDES else " ".join(tokens(plain)) or plain


def _block(place: int, name: ColumnName) -> _Block | None:
    """Interpret a name such as `1↑`, `up 2 [µm]`, `Abweichung vorwärts 3`, `+1`, `cycle_1_position` as readings."""
    text = name.base
    if (signed := re.fullmatch(r"\s*(?:(\d+)\s*([+-])|([+-])_?\s*(\d+))(.*)", text)) is not None:
        text = f"{'up' if (signed[2] or signed[3]) == '+' else 'down'} {signed[1] or signed[4]} {signed[5]}"
    for arrow, word in ARROWS.items():
        text = text.replace(arrow, word)
    words = tokens(re.sub(r"(?<=\D)(?=\d)|(?<=\d)(?=\D)", " ", text))
    sides = [word for word in words if word in SIDES and word.isalpha()]
    cycles = [word for word in words if word.isdecimal()]
    quantity = ""
    for word in (word for word in words if not word.isdecimal() and word not in sides):
        if word.startswith(POSITIONS):
            quantity = "position"
        elif word.startswith(DEVIATIONS):
            quantity = "deviation"
        elif word not in CYCLES and word not in FILLERS:
            return None
    if len(cycles) != 1 or len(sides) > 1 or not (sides or (quantity and CYCLES & set(words))):
        return None
    return _Block(place, sides[0] if sides else "", cycles[0], quantity)


def _long_form(raw: RawTable, names: Sequence[ColumnName], given: Entry) -> int:
    """Return the column of the readings in a table of the long form."""
    found = [k for role in ("position", "deviation") if role in given.columns for k in _places(names, role, given)] or [
        k for k, name in enumerate(names) if name.role in ("input", "gap", "deviation")
    ]
    if len(found) != 1:
        listed = " or ".join(f"'{raw.columns[k].name}'" for k in found) or "none of the columns, by its name"
        raise OpenQuestionError(
            raw.path,
            KIND,
            [
                Question(
                    f"the table has targets and directions, and the column of its readings may be {listed}",
                    f"columns.position={raw.columns[found[0]].name if found else 'NAME'}",
                )
            ],
        )
    return found[0]


def _quantity(
    raw: RawTable, names: Sequence[ColumnName], place: int, target_mm: Numbers, given: Entry, questions: list[Question]
) -> str:
    """Decide whether readings are positions or deviations: as the user states, by name, or by the range of values."""
    for role in ("position", "deviation"):
        if role in given.columns or role in given.units:
            return role
    if names[place].role == "deviation":
        return "deviation"
    if names[place].role in ("input", "gap"):
        return "position"
    values = _length(raw, names, place, "deviation", given, questions)
    both = values.present & target_mm.present
    if questions or not both.any() or np.ptp(target_mm.value[both]) == 0.0:
        return "deviation"
    share = float(np.ptp(values.value[both]) / np.ptp(target_mm.value[both]))
    if SMALLEST_TRAVEL <= share <= LARGEST_DEVIATION:
        questions.append(
            Question(
                f"'{raw.columns[place].name}' may hold positions or deviations from the target",
                "units.deviation=um",
            )
        )
    return "deviation" if share < SMALLEST_TRAVEL else "position"


def _length(
    raw: RawTable, names: Sequence[ColumnName], place: int, role: str, given: Entry, questions: list[Question]
) -> Numbers:
    """Return a column of lengths converted to mm; open questions about its unit are added to `questions`."""
    column = raw.columns[place]
    unit = given.units.get(role) or column.unit or names[place].unit
    size = factor(unit, "length") if unit else None
    if size is None:
        why = f"is '{unit}', which is not a length" if unit else "is not stated"
        questions.append(Question(f"the unit of '{column.name}' ({role}) {why}", f"units.{role}=mm"))
    values = _plain(raw, place)
    if size is None or size == 1.0:
        return values
    # Twelve digits (a picometre in a metre) remove the rounding errors of the conversion.
    return Numbers(np.array([float(f"{size * value:.12g}") for value in values.value]), values.present)


def _plain(raw: RawTable, place: int) -> Numbers:
    content = raw.columns[place].content
    if isinstance(content, Numbers):
        return content
    values, odd = to_numbers(content, str(raw.settings.get("decimal", ".")))
    if odd.size:
        at = int(odd[0])
        raise DataError(
            f"'{raw.columns[place].name}' of {raw.path} must hold numbers, but holds '{content[at][:40]}' in "
            f"{raw.place(at)}: correct the cell, or leave it empty."
        )
    return values


def _seconds(
    raw: RawTable, names: Sequence[ColumnName], place: int, given: Entry, questions: list[Question]
) -> Numbers:
    """Return the times (s) of a table of the long form."""
    content = raw.columns[place].content
    if not isinstance(content, Numbers) and looks_like_time(content):
        return seconds_of(content, given.words.get("date_order", "")).numbers
    unit = given.units.get("time") or raw.columns[place].unit or names[place].unit
    size = factor(unit, "time") if unit else None
    if size is None:
        questions.append(Question(f"the unit of '{raw.columns[place].name}' (time) is not stated", "units.time=s"))
    values = _plain(raw, place)
    return Numbers(values.value * (size or 1.0), values.present)


def _readings(
    raw: RawTable,
    target_mm: Numbers,
    blocks: Sequence[_Block],
    values: Sequence[Numbers],
    beside: _Beside,
    *,
    is_relative: bool,
) -> list[Reading]:
    """Collect the readings of all columns."""
    words = beside.words
    rows = range(target_mm.value.size)
    cycles = words.get("cycle", [""] * len(rows))
    cells = [(row, block, block.cycle or cycles[row]) for row in rows for block in blocks]
    names = [cycle for _, _, cycle in cells]
    numbers = {name: k for k, name in enumerate(sorted(set(names), key=_cycle_order(names)))}
    of_column = {block.place: each for block, each in zip(blocks, values, strict=True)}
    out: list[Reading] = []
    seen: dict[tuple[str, float, int, int], int] = {}
    for row, block, cycle_name in cells:
        if not target_mm.present[row]:
            raise DataError(f"The target must be a number, but is empty in {raw.place(row)} of {raw.path}.")
        stated_word = block.side or words["direction"][row]
        word = _side(stated_word)
        if word not in SIDES:
            raise DataError(
                f"direction must be up (from below) or down (from above), or a word for it such as + and -, +1 and -1, "
                f"forward and backward, but is {stated_word or 'empty'} in {raw.place(row)} of {raw.path}: rename it."
            )
        target, side = float(target_mm.value[row]), SIDES[word]
        run = words["run"][row] if "run" in words else ""
        cycle = numbers[cycle_name]
        key = (run, target, side, cycle)
        if not cycle_name:
            cycle = seen.get(key, 0)
        elif key in seen:
            raise DataError(
                f"Each target must occur once in each cycle and direction, but {target:g} mm, cycle {cycle_name}, "
                f"{stated_word} occurs twice in {raw.path}: number the cycles, or name the runs in a column run."
            )
        seen[key] = seen.get(key, 0) + 1
        value = _at(of_column[block.place], row)
        position = None if value is None else value + (target if is_relative else 0.0)
        out.append(Reading(target, position, side, cycle, run, _at(beside.time_s, row), _at(beside.u_mm, row)))
    return out


def _at(numbers: Numbers | None, row: int) -> float | None:
    """Number in a row of a column; None if there is none."""
    return float(numbers.value[row]) if numbers is not None and numbers.present[row] else None


def _cycle_order(names: list[str]) -> Callable[[str], float]:
    """Sort cycles by number, or by their first row if they are not numbers."""
    try:
        by_number = {name: float(name) for name in names}
    except ValueError:
        return names.index
    return by_number.__getitem__


def _check_quantity(path: Path, readings: list[Reading], quantity: str) -> None:
    """Refuse deviations that are labelled as positions, and positions labelled as deviations."""
    known = [(r.target_mm, r.position_mm) for r in readings if r.position_mm is not None]
    if len(known) < 2 or len({target for target, _ in known}) < 2:
        return
    targets, positions = (np.array(column) for column in zip(*known, strict=True))
    values = positions - targets if quantity.startswith("deviation") else positions
    share = float(np.ptp(values) / np.ptp(targets))
    if quantity.startswith("deviation") and share > LARGEST_DEVIATION:
        raise DataError(
            f"The {quantity} must be position minus target, but ranges over {np.ptp(values):g} mm while the targets "
            f"range over {np.ptp(targets):g} mm in {path}: these are positions; name the column so."
        )
    if quantity.startswith("position") and share < SMALLEST_TRAVEL:
        raise DataError(
            f"The {quantity} must range about as far as the target, which ranges over {np.ptp(targets):g} mm, but "
            f"ranges over {np.ptp(values):g} mm in {path}: if the values are deviations from the target, name the "
            "column so."
        )
