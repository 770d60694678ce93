"""Tables of other programs, read by a user who obeys every advice of the reader for up to six rounds.

Run as `python -m tests.benchmarks.foreign_tables [--each 40] [--seed 1] [--show]` from the top. Tables with three
decimals and commas, other units, several axes, set-points, layouts of makers, and clocks that leap or lost values are
drawn with known truth (`foreign/drawn.py`, which shares nothing with the reader). If the reader asks, the user runs the
command that the message ends with. If a question lists several readings, the user takes the one whose numbers fit the
measurement, and where none does, the one for counts (whose size this user does not know), or else the first. Printed
for each class: tables read rightly without a question, wrongly without a question (must be 0), rightly after obeying,
wrongly after obeying (must be 0), and dead ends (at most one in ten). Exit code 1 if a bar is not met.
"""

import re
import shlex
import tempfile
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.domain.errors import FingervisionError
from fingervision.tables.questions import OpenQuestionError, Reading
from fingervision.tables.read import read_drive, read_measured_table
from tests.benchmarks.foreign.drawn import CLASSES, Drawn, Values, drawn
from tests.benchmarks.frame import Namespace, Tally, benchmark

ROUNDS = 6
OUTCOMES = ("right", "wrong", "right after advice", "wrong after advice", "dead end")
RELATIVE = 2e-3
"""Largest difference from the truth, as a share of the range; units and columns are wrong by far more."""
LEAST_ROWS = 0.95
NUMBERS = re.compile(r"([-+\d.e]+) to ([-+\d.e]+)")


def outcome(table: Drawn, folder: Path, tell: list[str]) -> str:
    """Read a table, obey each advice, and compare with the truth."""
    path = folder / table.name
    path.write_text(table.text, encoding=table.encoding)
    for turn in range(ROUNDS + 1):
        try:
            found = _read(table, path)
        except OpenQuestionError as error:
            tell.append(str(error))
            command = _advice(error, table)
            done = CliRunner().invoke(cli, command)
            tell.append(f"-> {' '.join(command[2:])}: {done.exit_code}")
        except FingervisionError as error:
            tell.append(str(error))
            return "dead end"
        else:
            wrong = _difference(table, found)
            tell += wrong
            return ("wrong" if wrong else "right") + (" after advice" if turn else "")
    return "dead end"


def _read(table: Drawn, path: Path) -> dict[str, Values]:
    if table.kind == "drive":
        drive = read_drive(path)
        return {"time_s": drive.time_s, "input_mm": drive.input_mm}
    measured = read_measured_table(path)
    found = {"input_mm": measured.input_mm, "gap_mm": measured.gap_mm}
    return found if measured.time_s is None else {**found, "time_s": measured.time_s}


def _difference(table: Drawn, found: dict[str, Values]) -> list[str]:
    """Sentences on how the numbers differ from the truth; empty if they agree."""
    truth = {"time_s": table.time_s, "input_mm": table.input_mm, "gap_mm": table.gap_mm}
    if not LEAST_ROWS * table.time_s.size <= found["input_mm"].size <= table.time_s.size:
        return [f"{found['input_mm'].size} of {table.time_s.size} rows"]
    rows = np.arange(table.time_s.size)
    if "time_s" in found:
        clock = found["time_s"] - found["time_s"][0]
        rows = np.array([np.argmin(np.abs(table.time_s - table.time_s[0] - time)) for time in clock])
        found = {**found, "time_s": clock + table.time_s[0]}
    elif found["input_mm"].size != rows.size:
        return ["rows are missing, and no time tells which"]
    else:  # without times, the order of rows means nothing
        order = np.lexsort((found["gap_mm"], found["input_mm"]))
        found = {name: values[order] for name, values in found.items()}
        rows = np.lexsort((truth["gap_mm"], np.round(table.input_mm, 9)))
    out = []
    for name, values in found.items():
        want = truth[name]
        assert want is not None
        worst = float(np.max(np.abs(values - want[rows])))
        if worst > RELATIVE * max(float(np.ptp(want)), 0.01):
            out.append(f"{name} differs by {worst:g}: {values[:3]} for {want[rows][:3]}")
    return out


def _advice(error: OpenQuestionError, table: Drawn) -> list[str]:
    """Arguments of the command with which the message ends, each question answered by the reading that fits."""
    command = str(error).rsplit(": fingervision ", 1)[-1]
    words = shlex.split(command)
    for question in error.questions:
        fitting = [each.key for each in question.readings if _fits(each, table)]
        fitting += [each.key for each in question.readings if "SIZE" in each.key]
        if fitting:
            words[words.index(question.key)] = fitting[0]
    return words


def _fits(reading: Reading, table: Drawn) -> bool:
    """Whether the numbers that a reading states are those of the measurement, as its user knows them."""
    role = reading.key.partition("=")[0].partition(".")[2]
    truth = {"time": table.time_s, "input": table.input_mm, "gap": table.gap_mm}
    known = [truth[role]] if role in truth else list(truth.values())
    ranges = [(float(np.min(v)), float(np.max(v))) for v in known if v is not None]
    if role in ("", "time"):
        ranges.append((0.0, float(np.ptp(table.time_s))))
    stated = [(float(a), float(b)) for a, b in NUMBERS.findall(reading.gives)]
    # Without a unit, the user knows the numbers in the unit in which they were written.
    scales = (1.0,) if reading.gives.endswith((" mm", " s")) else (1.0, 1e3, 1e-3, 1e6, 1.0 / 25.4)
    return bool(stated) and all(
        any(
            abs(a - size * low) + abs(b - size * high) < size * (0.02 * (high - low) + 0.002 * abs(high))
            for low, high in ranges
            for size in scales
        )
        for a, b in stated
    )


@benchmark(
    each=40,
    seed=1,
    only={"choices": list(CLASSES)},
    show={"action": "store_true", "help": "print what was said for each table not simply right"},
)
def main(given: Namespace) -> None:
    """Draw, obey, compare, print."""
    tally = Tally(*OUTCOMES)
    with tempfile.TemporaryDirectory() as top:
        for number, (label, table) in enumerate(drawn(given.seed, given.each)):
            if given.only and label != given.only:
                continue
            folder = Path(top) / str(number)
            folder.mkdir()
            tell: list[str] = []
            result = outcome(table, folder, tell)
            tally.add([label], [result])
            if given.show and result != "right":
                print(f"{label} {number} {table.what} [{table.kind}]: {result}", *tell, sep="\n    ")
    tally.show()
    total = tally.of["all"]
    bad = total["wrong"] + total["wrong after advice"]
    raise SystemExit(bad > 0 or 10 * total["dead end"] > sum(total.values()))
