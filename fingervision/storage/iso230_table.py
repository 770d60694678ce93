"""A table of targets, cycles and directions (ISO 230-2), converted to rows of a measured table in the order of travel.

Long form, one row per reading: `target_mm, cycle, direction` and one of `position_mm, position_um, deviation_mm,
deviation_um`, optionally with `time_s, run, u_random_mm`. Matrix form, one row per target: `target_mm` and columns such
as `up_1_deviation_um`, `down_1_deviation_um`; or `cycle_1_position_mm` with a `direction` column.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import header_of, read_columns
from fingervision.storage.number_columns import Numbers, numbers_in

# Reconstruct the path of an axis between readings at target positions, from the direction of approach of each.

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
    """One reading at a target: position (None if missing), direction (+1 from below, -1 from above), cycle, time."""

    target_mm: float
    position_mm: float | None
    side: int
    cycle: int
    run: str = ""
    time_s: float | None = None
    u_random_mm: float | None = None


@dataclass(frozen=True, slots=True)
class PathRow:
    """A row of a measured table; a row without a gap is only a point on the path of the input."""

    input_mm: float
    gap_mm: float | None
    time_s: float
    run: str
    u_random_mm: float | None = None


def approach_path(readings: Sequence[Reading]) -> tuple[tuple[PathRow, ...], tuple[str, ...]]:
    """Sort readings in the order of travel, and add a row beyond a target wherever the axis must have overshot it.

    Parameters
    ----------
    readings : sequence of Reading
        Readings in any order; each target occurs once per run, cycle and direction.

    Returns
    -------
    rows : tuple of PathRow
        Rows, run after run, with increasing times within each run.
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
    rows: list[PathRow] = []
    added = 0
    for run in dict.fromkeys(reading.run for reading in readings):
        mine = [reading for reading in readings if reading.run == run]
        ordered = sorted(mine, key=_time) if timed else sorted(mine, key=_travel)
        path, times = _with_overshoots(ordered, beyond, timed)
        added += len(path) - len(ordered)
        rows += [replace(row, time_s=time) for row, time in zip(path, times, strict=True)]
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


def _with_overshoots(ordered: Sequence[Reading], beyond: float, timed: bool) -> tuple[list[PathRow], list[float]]:
    """Rows of a run with their times; an added overshoot has the mean time of its neighbouring rows."""
    path: list[PathRow] = []
    times: list[float] = []
    clock = [_time(reading) for reading in ordered]
    usual = float(np.median(np.diff(clock))) if timed and len(clock) > 1 else NOMINAL_S
    for reading, time in zip(ordered, clock, strict=True):
        came_from = path[-1].input_mm if path else None
        if came_from is None or reading.side * (reading.target_mm - came_from) <= 0.0:
            path.append(PathRow(reading.target_mm - reading.side * beyond, None, 0.0, reading.run))
            times.append((times[-1] + time) / 2.0 if times else time - usual / 2.0)
        path.append(PathRow(reading.target_mm, reading.position_mm, 0.0, reading.run, reading.u_random_mm))
        times.append(time)
    if not timed:
        times = [NOMINAL_S * k for k in range(len(path))]
    return path, times


TARGET = "target_mm"
QUANTITIES = {"position_mm": 1.0, "position_um": 1e-3, "deviation_mm": 1.0, "deviation_um": 1e-3}
"""Names of the columns of readings, with the factor to convert each to mm."""
FROM_BELOW = "+ +1 1 up u forward forwards fwd positive pos increasing ascending rising ↑"
FROM_ABOVE = "- -1 down d backward backwards bwd reverse rev negative neg decreasing descending falling ↓"
SIDES = dict.fromkeys(FROM_BELOW.split(), 1) | dict.fromkeys(FROM_ABOVE.split(), -1)
MINUS = "\N{MINUS SIGN}"
MATRIX = re.compile(
    r"(?P<side>[^\d\s_]+)_?(?P<cycle>\d+)_(?P<quantity>(?:position|deviation)_(?:mm|um))", re.IGNORECASE
)
FORWARD = {"forward", "forwards", "fwd"}
"""Ambiguous words for a direction: some authors mean along the axis, others towards its zero."""
UNSIDED = "cycle"
OTHERS = ("direction", "cycle", "run", "time_s", "u_random_mm")
"""Names of the other columns."""
SMALLEST_TRAVEL = 0.05
"""Ratio of the range of positions to the range of targets below which the positions must be mislabelled deviations."""
LARGEST_DEVIATION = 0.5
"""Ratio of the range of deviations to the range of targets above which the deviations must be mislabelled positions,
because no axis has an error of half its travel."""


@dataclass(frozen=True, slots=True)
class Iso230Rows:
    """Rows of a measured table, including added rows for overshoots, and one sentence for each assumption."""

    rows: tuple[PathRow, ...]
    notes: tuple[str, ...]

    def cells(self) -> dict[str, list[str]]:
        """Columns `input_mm, gap_mm, time_s` and, if present, `run, u_random_mm`, as text; a missing gap is ''."""
        out = {
            "input_mm": [repr(row.input_mm) for row in self.rows],
            "gap_mm": ["" if row.gap_mm is None else repr(row.gap_mm) for row in self.rows],
            "time_s": [repr(row.time_s) for row in self.rows],
        }
        if any(row.run for row in self.rows):
            out["run"] = [row.run for row in self.rows]
        if any(row.u_random_mm is not None for row in self.rows):
            out["u_random_mm"] = ["" if row.u_random_mm is None else repr(row.u_random_mm) for row in self.rows]
        return out


def read_iso230_table(path: Path) -> Iso230Rows | None:
    """Read a table of targets, cycles and directions; None if the file is another kind of table.

    The measured position, or target plus deviation, is taken as the gap. Rows are sorted in the order of travel: by
    `time_s` if every row has a time; otherwise cycle by cycle, first the targets approached from below in ascending
    order, then those approached from above in descending order, with one reading every 30 s. If a target could not be
    reached from its stated direction, a row without a gap is added beyond the target.

    Raises
    ------
    DataError
        A column is missing, a word is not a direction, a reading occurs twice, or deviations are labelled as positions
        (or positions as deviations).
    """
    names = header_of(path)
    if TARGET not in names or "input_mm" in names:
        return None
    known = [name for name in names if name in (*QUANTITIES, *OTHERS) or MATRIX.fullmatch(name)]
    table = read_columns(path, (TARGET,), texts=(TARGET, *known))
    return iso230_rows(path, {name: table.texts(name) or () for name in table.columns})


def iso230_rows(path: Path, columns: Mapping[str, Sequence[str]]) -> Iso230Rows:
    """Convert the columns of a table of targets, cycles and directions.

    Parameters
    ----------
    path : Path
        File of the columns, for error messages.
    columns : mapping of str to sequence of str
        Cells of the columns, by name.

    Raises
    ------
    DataError
        For the same reasons as in `read_iso230_table`.
    """
    blocks = {name: match for name in columns if (match := MATRIX.fullmatch(name)) is not None}
    quantities = {name: match["quantity"].lower() for name, match in blocks.items()} or {
        name: name for name in QUANTITIES if name in columns
    }
    kinds = sorted(set(quantities.values()))
    if len(kinds) != 1:
        raise DataError(
            f"{path} must have a readings column named one of {', '.join(QUANTITIES)}, but has "
            f"{' and '.join(kinds) or ','.join(columns)}: rename that column, or use one column for each "
            "cycle and direction (up_1_deviation_um, down_1_deviation_um and so on)."
        )
    sided = bool(blocks) and all(match["side"].lower() != UNSIDED for match in blocks.values())
    if not sided and "direction" not in columns:
        raise DataError(
            f"{path} must have a column direction (up or down: the side from which the target was approached), but "
            f"has {','.join(columns)}: add it; or, if the rows are in the order of travel, name the columns "
            "input_mm and gap_mm."
        )
    wanted = ("run", *(() if sided else ("direction",)), *(() if blocks else ("cycle", "time_s", "u_random_mm")))
    cells = {name: columns[name] for name in (TARGET, *quantities, *wanted) if name in columns}
    listed = _cells(cells, blocks, next(iter(quantities)))
    readings, words = _readings(path, listed, kinds[0], cells)
    _check_quantity(path, readings, kinds[0])
    rows, assumed = approach_path(readings)
    notes = [
        f"Read as an ISO 230-2 table: {len({r.target_mm for r in readings})} targets, "
        f"{len({(r.run, r.cycle) for r in readings})} cycles; input = target, gap = "
        f"{'position' if kinds[0].startswith('position') else 'target + deviation'}."
    ]
    if words & FORWARD:
        notes.append(
            f"The direction {sorted(words & FORWARD)[0]} was taken as the approach from below (the input increases). "
            f"Some published reports use this word for the approach from above: if the reversal has the wrong sign in "
            f"the result, exchange the directions."
        )
    return Iso230Rows(rows, (*notes, *assumed))


@dataclass(frozen=True, slots=True)
class _Cell:
    """A cell with a reading: its row, column, word for the direction, and cycle ('' if only the order states it)."""

    row: int
    column: str
    direction: str
    cycle: str


def _cells(cells: Mapping[str, Sequence[str]], blocks: dict[str, re.Match[str]], column: str) -> list[_Cell]:
    """List all cells that may contain a reading, in the long form or the matrix form of the table."""
    directions = cells.get("direction")
    if not blocks:
        cycles = cells.get("cycle", [""] * len(cells[TARGET]))
        return [_Cell(row, column, directions[row], cycles[row]) for row in range(len(cycles))] if directions else []
    return [
        _Cell(row, name, directions[row] if directions else match["side"], match["cycle"])
        for name, match in blocks.items()
        for row in range(len(cells[TARGET]))
    ]


def _readings(
    path: Path, listed: list[_Cell], quantity: str, cells: Mapping[str, Sequence[str]]
) -> tuple[list[Reading], set[str]]:
    """Convert cells to readings; also return the words for directions that the table uses."""
    factor, relative = QUANTITIES[quantity], quantity.startswith("deviation")
    columns = {
        name: numbers_in(path, name, cells[name])
        for name in (TARGET, "time_s", "u_random_mm", *dict.fromkeys(cell.column for cell in listed))
        if name in cells
    }
    names = [cell.cycle for cell in listed]
    numbers = {name: k for k, name in enumerate(sorted(set(names), key=_cycle_order(names)))}
    out: list[Reading] = []
    seen: dict[tuple[str, float, int, int], int] = {}
    words = set()
    for cell in listed:
        target = _at(columns.get(TARGET), cell.row)
        if target is None:
            raise DataError(f"{TARGET} must be a number, but is empty in data row {cell.row + 1} of {path}.")
        word = cell.direction.strip().lower().replace(MINUS, "-")
        word = re.sub(r"^([+-]?1)\.0*$", r"\1", word)
        if word not in SIDES:
            raise DataError(
                f"direction must be up (from below) or down (from above), or a word for it such as + and -, +1 and -1, "
                f"forward and backward, but is {cell.direction or 'empty'} in data row {cell.row + 1} of {path}: "
                "rename it."
            )
        words.add(word)
        run = cells["run"][cell.row] if "run" in cells else ""
        value = _at(columns[cell.column], cell.row)
        side = SIDES[word]
        cycle = numbers[cell.cycle]
        key = (run, target, side, cycle)
        if not cell.cycle:
            cycle = seen.get(key, 0)
        elif key in seen:
            raise DataError(
                f"Each target must occur once in each cycle and direction, but {target:g} mm, cycle {cell.cycle}, "
                f"{cell.direction} occurs twice in {path}: number the cycles, or name the runs in a column run."
            )
        seen[key] = seen.get(key, 0) + 1
        position = None if value is None else factor * value + (target if relative else 0.0)
        timed, u = (_at(columns.get(name), cell.row) for name in ("time_s", "u_random_mm"))
        out.append(Reading(target, position, side, cycle, run, timed, u))
    return out, words


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
            f"{quantity} must be position minus target, but ranges over {np.ptp(values):g} mm while the targets range "
            f"over {np.ptp(targets):g} mm in {path}: these are positions; name the column "
            f"{quantity.replace('deviation', 'position')}."
        )
    if quantity.startswith("position") and share < SMALLEST_TRAVEL:
        raise DataError(
            f"{quantity} must range about as far as the target, which ranges over {np.ptp(targets):g} mm, but ranges "
            f"over {np.ptp(values):g} mm in {path}: if the values are deviations from the target, name the column "
            f"{quantity.replace('position', 'deviation')}."
        )
