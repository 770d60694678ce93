"""Tables of targets, cycles and directions become measured tables; bad ones end in a sentence."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.report.positioning_accuracy import positioning_accuracy
from fingervision.domain.errors import FingervisionError
from fingervision.motion.repeated_targets import RepeatedTargets, repeated_targets
from fingervision.tables.formats import read_raw
from fingervision.tables.iso230 import Iso230Rows, iso230_rows_of
from fingervision.tables.mapping import Entry
from fingervision.tables.read import read_measured_table
from tests.csv_rows import csv_rows

TARGETS = (-2.0, -1.0, 0.0, 1.0, 2.0)
CYCLES = 3
RNG = np.random.default_rng(11)
DEVIATION = {
    (t, c, s): float(RNG.normal(0.0, 0.002) - 0.005 * s) for t in TARGETS for c in range(1, CYCLES + 1) for s in (1, -1)
}
"""Deviation of every target, cycle and side, mm."""


def read_iso230_table(path: Path) -> Iso230Rows | None:
    return iso230_rows_of(read_raw(path, Entry()), Entry())


def write(folder: Path, text: str, name: str = "measured.csv") -> Path:
    path = folder / name
    path.write_text(text + "\n", encoding="utf-8")
    return path


def long_form(column: str = "position_mm", words: tuple[str, str] = ("up", "down"), shuffled: bool = False) -> str:
    factor = 1e3 if column.endswith("um") else 1.0
    rows = []
    for (target, cycle, side), deviation in DEVIATION.items():
        value = factor * (deviation + (target if column.startswith("position") else 0.0))
        rows.append(f"{target},{cycle},{words[0] if side > 0 else words[1]},{value!r}")
    order = np.random.default_rng(5).permutation(len(rows)) if shuffled else range(len(rows))
    return "\n".join([f"target_mm,cycle,direction,{column}", *(rows[k] for k in order)])


def matrix(stem: tuple[str, str] = ("up", "down"), quantity: str = "deviation_um") -> str:
    names = [f"{stem[0 if s > 0 else 1]}_{c}_{quantity}" for s in (1, -1) for c in range(1, CYCLES + 1)]
    rows = [
        ",".join([repr(t), *(repr(1e3 * DEVIATION[t, c, s]) for s in (1, -1) for c in range(1, CYCLES + 1))])
        for t in TARGETS
    ]
    return "\n".join([",".join(["target_mm", *names]), *rows])


def stacked() -> str:
    names = [f"cycle_{c}_deviation_mm" for c in range(1, CYCLES + 1)]
    rows = [
        ",".join([repr(t), word, *(repr(DEVIATION[t, c, s]) for c in range(1, CYCLES + 1))])
        for s, word in ((1, "+"), (-1, "-"))
        for t in TARGETS
    ]
    return "\n".join([",".join(["target_mm", "direction", *names]), *rows])


def check(path: Path) -> None:
    """Every reading is at its target, with its deviation, approached from its side in its cycle."""
    read = read_iso230_table(path)
    assert read is not None
    inputs = np.array([row.target_mm for row in read.rows])
    measured = np.array([row.position_mm is not None for row in read.rows])
    visits = repeated_targets(inputs, measured, (slice(0, inputs.size),), np.array([row.time_s for row in read.rows]))
    assert isinstance(visits, RepeatedTargets)
    gaps = np.array([row.position_mm for row in read.rows if row.position_mm is not None])
    assert gaps.size == len(DEVIATION)
    for gap, target, cycle, side in zip(gaps, inputs[measured], visits.cycle, visits.direction, strict=True):
        assert gap - target == pytest.approx(DEVIATION[target, cycle + 1, side], abs=1e-9)


@pytest.mark.parametrize("column", ["position_mm", "position_um", "deviation_mm", "deviation_um"])
@pytest.mark.parametrize("shuffled", [False, True])
def test_the_long_form_in_any_order(tmp_path: Path, column: str, shuffled: bool) -> None:
    check(write(tmp_path, long_form(column, shuffled=shuffled)))


@pytest.mark.parametrize(
    "words",
    [
        ("+", "-"), ("+1", "-1"), ("1", "-1"), ("1.0", "-1.0"), ("Forward", "Backward"), ("forward", "reverse"),
        ("positive", "negative"), ("UP", "DOWN"), ("+", "\N{MINUS SIGN}"), (" fwd ", "bwd"), ("↑", "↓"),
    ],
)  # fmt: skip
def test_directions_in_many_words(tmp_path: Path, words: tuple[str, str]) -> None:
    check(write(tmp_path, long_form(words=words)))


@pytest.mark.parametrize("text", [matrix(), matrix(("forward", "reverse")), matrix(("+", "-")), stacked()])
def test_matrices(tmp_path: Path, text: str) -> None:
    check(write(tmp_path, text))


def test_the_reader_of_measured_tables_takes_the_rows(tmp_path: Path) -> None:
    table = read_measured_table(write(tmp_path, long_form()))
    assert table.input_mm.size == len(DEVIATION)
    assert np.all(np.diff(table.time_s) > 0.0)


def test_overshoots_lead_to_the_stated_side(tmp_path: Path) -> None:
    read = read_iso230_table(write(tmp_path, long_form()))
    beyond = [row.target_mm for row in read.rows if row.position_mm is None]
    assert beyond == [-2.5, 2.5] * CYCLES
    assert any("rows without a gap were added 0.5 mm beyond" in note for note in read.notes)
    assert any("no times" in note and "30 s" in note for note in read.notes)


def test_a_single_direction_is_approached_from_it_each_time(tmp_path: Path) -> None:
    text = "\n".join(line for line in long_form().splitlines() if ",up," not in line)
    read = read_iso230_table(write(tmp_path, text))
    assert [row.target_mm for row in read.rows if row.position_mm is None] == [2.5] * CYCLES
    inputs = np.array([row.target_mm for row in read.rows])
    visits = repeated_targets(
        inputs, np.array([r.position_mm is not None for r in read.rows]), (slice(0, inputs.size),)
    )
    assert np.all(visits.direction == -1)


def test_times_give_the_order_and_stay(tmp_path: Path) -> None:
    # A pilgrim-step cycle: each target from below and from above before the next.
    lines, time = ["target_mm,cycle,direction,position_mm,time_s"], 0.0
    for cycle in (1, 2):
        for target in (0.0, 1.0, 2.0):
            for word, sign in (("up", 1), ("down", -1)):
                lines.append(f"{target},{cycle},{word},{target - 0.01 * sign},{time}")
                time += 10.0
    read = read_iso230_table(write(tmp_path, "\n".join(lines)))
    readings = [row for row in read.rows if row.position_mm is not None]
    assert [row.time_s for row in readings] == [10.0 * k for k in range(12)]
    times = np.array([row.time_s for row in read.rows])
    assert np.all(np.diff(times) > 0.0)
    inputs = np.array([row.target_mm for row in read.rows])
    visits = repeated_targets(
        inputs, np.array([r.position_mm is not None for r in read.rows]), (slice(0, inputs.size),)
    )
    assert np.array_equal(visits.direction, np.tile([1, -1], 6))
    deviation = np.array([row.position_mm for row in readings]) - visits.target_mm
    found = positioning_accuracy(visits.target_mm, deviation, visits.direction, visits.cycle)
    assert found.value_mm("B_mean") == pytest.approx(-0.02)
    assert not any("no times" in note for note in read.notes)


def travelled(words: tuple[str, str], *, timed: bool) -> str:
    """Three cycles in the order of travel, 20 um of play, with the words for up and down."""
    lines, time = ["target_mm,cycle,direction,position_mm" + ",time_s" * timed], 0.0
    for cycle in (1, 2, 3):
        for side, word in zip((1, -1), words, strict=True):
            for target in TARGETS[::side]:
                lines.append(f"{target},{cycle},{word},{target - 0.01 * side}" + f",{time}" * timed)
                time += 28.5
    return "\n".join(lines)


def test_directions_against_the_times_are_exchanged_and_told(tmp_path: Path) -> None:
    right, wrong = (
        read_iso230_table(write(tmp_path, travelled(words, timed=True)))
        for words in (("up", "down"), ("backward", "forward"))
    )
    assert wrong.rows == right.rows
    assert any("the two directions were exchanged" in note for note in wrong.notes)
    assert not any("swapped" in note for note in right.notes)


def test_directions_against_the_order_of_rows_are_asked_about(tmp_path: Path) -> None:
    for words, asked in ((("up", "down"), False), (("down", "up"), True)):
        read = read_iso230_table(write(tmp_path, travelled(words, timed=False)))
        assert any("are the two directions exchanged in the table?" in note for note in read.notes) == asked
    # Sorted by target, or shuffled, the order says nothing.
    for text in (long_form(), long_form(shuffled=True), matrix(), stacked()):
        assert not any("swapped" in note for note in read_iso230_table(write(tmp_path, text)).notes)


def test_runs_cycles_without_numbers_and_missing_readings(tmp_path: Path) -> None:
    lines = ["run,target_mm,cycle,direction,deviation_mm,u_random_mm"]
    for run in ("cold", "warm"):
        for cycle in ("first", "second", "a third"):
            lines += [f"{run},{t},{cycle},up,{0.001 if t else ''},0.0005" for t in (0, 1, 2)]
    read = read_iso230_table(write(tmp_path, "\n".join(lines)))
    assert list(dict.fromkeys(row.run for row in read.rows)) == ["cold", "warm"]
    assert sum(row.position_mm is None for row in read.rows) == 12  # six overshoots, six missing readings
    assert read.rows[0].time_s == read.rows[12].time_s == 0.0
    assert {row.u_random_mm for row in read.rows} == {None, 0.0005}


def test_cycles_may_be_left_out(tmp_path: Path) -> None:
    text = "\n".join(",".join(np.delete(line.split(","), 1)) for line in long_form().splitlines())
    check(write(tmp_path, text))


def test_a_word_that_may_mean_either_side_is_told(tmp_path: Path) -> None:
    assert any(
        "exchange the directions" in note
        for note in read_iso230_table(write(tmp_path, long_form(words=("forward", "backward")))).notes
    )
    assert not any("exchange the directions" in note for note in read_iso230_table(write(tmp_path, long_form())).notes)


@pytest.mark.parametrize("text", ["input_mm,gap_mm\n0,4\n1,5", "input_mm,gap_mm,target_mm\n0,4,0\n1,5,1"])
def test_other_tables_are_left_to_their_reader(tmp_path: Path, text: str) -> None:
    assert read_iso230_table(write(tmp_path, text)) is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("target_mm,cycle,direction\n0,1,up", "the column of its readings may be none"),
        ("target_mm,cycle,direction,position_mm,deviation_mm\n0,1,up,0,0", "'position_mm' or 'deviation_mm'"),
        ("target_mm,cycle,position_mm\n0,1,0", "must have a column direction.*input_mm and gap_mm"),
        ("target_mm,cycle,direction,position_mm\n0,1,sideways,0", "but is sideways in line 2"),
        ("target_mm,cycle,direction,position_mm\n0,1,,0", "but is empty in line 2"),
        ("target_mm,cycle,direction,position_mm\n,1,up,0", "target must be a number, but is empty in line 2"),
        ("target_mm,cycle,direction,position_mm\n0,1,up,much", "'position_mm' .* must hold numbers, but holds 'much'"),
        ("target_mm,cycle,direction,position_mm\n0,1,up,0\n0,1,up,0", "0 mm, cycle 1, up occurs twice"),
        (
            "target_mm,cycle,direction,position_mm\n" + "\n".join(f"{t},1,up,0.00{t}" for t in range(5)),
            "if the values are deviations from the target",
        ),
        (
            "target_mm,cycle,direction,deviation_um\n" + "\n".join(f"{t},1,up,{1000 * t + 3}" for t in range(5)),
            "these are positions",
        ),
        ("target_mm,up_1_deviation_um,down_1_position_um\n0,1,1", "positions or deviations, but has columns of both"),
        ("target_mm,cycle_1_deviation_um,cycle_2_deviation_um\n0,1,1", "must have a column direction"),
        ("target_mm,left_1_deviation_um,right_1_deviation_um\n0,1,1", "must have a column direction"),
    ],
)
def test_bad_tables_end_in_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(FingervisionError, match=words):
        read_iso230_table(write(tmp_path, text))


RIG = Path(__file__).parents[3] / "shared" / "real" / "rigs" / "ess_x_map_path" / "measured.csv"


@pytest.mark.skipif(not RIG.exists(), reason="the measured tables of real rigs are not here (../shared/real/rigs)")
def test_a_published_table_comes_back_in_its_order_of_travel(tmp_path: Path) -> None:
    rows = csv_rows(RIG)
    readings = [(float(row["input_mm"]), float(row["gap_mm"]) - 23.0) for row in rows if row["gap_mm"]]
    lines = [f"{t},{k // 18 + 1},{'up' if k % 18 < 9 else 'down'},{p!r}" for k, (t, p) in enumerate(readings)]
    order = np.random.default_rng(2).permutation(len(lines))
    text = "\n".join(["target_mm,cycle,direction,position_mm", *(lines[k] for k in order)])
    read = read_iso230_table(write(tmp_path, text))
    assert [row.target_mm for row in read.rows][: len(rows) - 1] == [float(row["input_mm"]) for row in rows][:-1]
    assert [row.position_mm for row in read.rows if row.position_mm is not None] == [
        position for _, position in readings
    ]
