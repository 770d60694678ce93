"""Tables of other programs: nothing is read wrongly in silence, and to obey an advice never gives a wrong table."""

from pathlib import Path

import pytest

from fingervision.domain.errors import DataError
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.read import read_measured_table
from tests.benchmarks.foreign.drawn import Drawn, drawn
from tests.benchmarks.foreign_tables import outcome

TABLES = drawn(seed=7, each=10)
NO_ADVICE_IS_POSSIBLE = "Rigol"
"""Volts of an oscilloscope: only the user knows what a volt is worth."""


@pytest.mark.parametrize(
    "table", [table for _, table in TABLES], ids=[f"{n}-{t[1].what}" for n, t in enumerate(TABLES)]
)
def test_a_foreign_table_is_read_rightly_or_asks_questions_whose_answers_are_right(
    table: Drawn, tmp_path: Path
) -> None:
    told: list[str] = []
    result = outcome(table, tmp_path, told)
    expected = ("dead end",) if table.what == NO_ADVICE_IS_POSSIBLE else ("right", "right after advice")
    assert result in expected, told


def test_the_axis_that_moves_is_the_input_and_two_moving_axes_are_asked_about(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f},{1e-4 * (k % 2):.4f},0.5,{0.01 * k:.3f},{3.0 + 0.1 * k:.2f}" for k in range(40)]
    table = tmp_path / "axes.csv"
    table.write_text("\n".join(["Time [s],X [mm],Y [mm],Z [mm],Gap [mm]", *rows]), encoding="utf-8")
    assert read_measured_table(table).input_mm.max() == pytest.approx(0.39)
    rows = [row.replace(",0.5,", ",0.55,") if k > 20 else row for k, row in enumerate(rows)]
    table.write_text("\n".join(["Time [s],X [mm],Y [mm],Z [mm],Gap [mm]", *rows]), encoding="utf-8")
    with pytest.raises(OpenQuestionError, match=r"0 to 0\.39 mm") as caught:
        read_measured_table(table)
    keys = [each.key for each in caught.value.questions[0].readings]
    assert {"columns.input=Z [mm]", "columns.input=Y [mm]"} == set(keys[:2])


def test_gaps_measured_without_the_input_are_to_be_measured_with_it(tmp_path: Path) -> None:
    header = "frame,time_s,status,gap_mm,u_gap_mm,u_random_mm,gap_px,u_gap_px,left_x_px,right_x_px"
    rows = [
        f"{k},{0.04 * k:.2f},ok,{4 + 0.1 * k:.1f},0.01,0.001,{136 + 3 * k},0.05,{250 - k},{390 + k}" for k in range(30)
    ]
    table = tmp_path / "gaps.csv"
    table.write_text("\n".join([header, *rows]), encoding="utf-8")
    with pytest.raises(DataError, match="--drive"):
        read_measured_table(table)
    # A column of the user's own beside them can be the input.
    table.write_text("\n".join([f"{header},stage position [mm]", *(f"{row},{row.split(',')[1]}" for row in rows)]))
    assert read_measured_table(table).input_mm.max() == pytest.approx(29 * 0.04)


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_metres_or_micrometres_called_millimetres_are_asked_about_even_if_both_columns_are(
    size: float, tmp_path: Path
) -> None:
    rows = [f"{0.1 * k:.1f},{size * 0.05 * k:.9g},{size * (0.3 + 0.2 * k):.9g}" for k in range(40)]
    table = tmp_path / "wrong.csv"
    table.write_text("\n".join(["Time [s],Position [mm],Gap [mm]", *rows]), encoding="utf-8")
    with pytest.raises(OpenQuestionError, match=r"0 to 1\.95 mm"):
        read_measured_table(table)


def test_whole_numbers_without_a_unit_may_be_counts_whose_size_only_the_user_knows(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f},{13000 + 20 * k},{0.3 + 0.2 * k:.3f}" for k in range(40)]
    table = tmp_path / "encoder.csv"
    table.write_text("\n".join(["Time [s],Encoder,Gap [mm]", *rows]), encoding="utf-8")
    with pytest.raises(OpenQuestionError, match="counts") as caught:
        read_measured_table(table)
    keys = [each.key for each in caught.value.questions[0].readings]
    assert keys[0] == "units.input=um"
    assert keys[-1] == "units.input=SIZE um"


def test_times_since_an_origin_are_times(tmp_path: Path) -> None:
    rows = [f"{3.8e9 + 0.1 * k:.1f}\t{0.01 * k:.3f}\t{0.3 + 0.2 * k:.3f}" for k in range(40)]
    table = tmp_path / "labview.txt"
    table.write_text("\n".join(["Time (s since 1904)\tPosition (mm)\tGap (mm)", *rows]), encoding="utf-8")
    time_s = read_measured_table(table).time_s
    assert time_s is not None
    assert time_s[-1] - time_s[0] == pytest.approx(3.9)


@pytest.mark.parametrize("header", ["time_s,input_mm", "Zeit [ms],Weg [mm]", "Date,Position [mm]"])
def test_times_are_never_suggested_as_the_gap_that_a_table_lacks(header: str, tmp_path: Path) -> None:
    dates = header.startswith("Date")
    times = [f"2026-03-01 10:00:{k:02d}" if dates else f"{0.1 * k:.1f}" for k in range(40)]
    table = tmp_path / "drive.csv"
    table.write_text("\n".join([header, *(f"{t},{0.05 * (k % 9):.2f}" for k, t in enumerate(times))]), encoding="utf-8")
    # The log of a drive was asked which of its columns is the gap, which none of them can be.
    with pytest.raises(DataError, match=r"log of the drive.*--drive drive.csv") as caught:
        read_measured_table(table)
    assert "columns.gap" not in str(caught.value)
