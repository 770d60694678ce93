"""gaps.csv: to the letter, and valid whenever writing stops."""

import csv
import resource
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingervision.domain.errors import DataError, FingervisionError, OutputError
from fingervision.domain.status import Status
from fingervision.storage.gaps_csv import COLUMNS, MM_PLACES, GapRow, GapsCsv, GapsReader
from tests.csv_rows import csv_rows

HEADER = (
    "frame,time_s,status,gap_mm,u_gap_mm,u_random_mm,gap_px,u_gap_px,left_x_px,left_y_px,right_x_px,right_y_px,"
    "left_tip_px,right_tip_px,left_mm,right_mm,"
    "u_shift_px,fingers,held_px,held_mm"
)
# Half a unit of the last place written.
MM_TOLERANCE = 0.51 * 10.0**-MM_PLACES


def test_the_header_is_the_formats(tmp_path: Path) -> None:
    assert COLUMNS == HEADER
    GapsCsv(tmp_path / "a.csv").close()
    assert (tmp_path / "a.csv").read_text() == HEADER + "\n"
    GapsCsv(tmp_path / "b.csv", ("run", "input_mm", "force_n")).close()
    assert (tmp_path / "b.csv").read_text() == HEADER + ",run,input_mm,force_n\n"


def test_what_is_not_known_is_an_empty_cell(tmp_path: Path) -> None:
    with GapsCsv(tmp_path / "gaps.csv", ("run", "input_mm")) as table:
        table.add([GapRow(0, None, Status.TOUCHING), GapRow(1, 0.04, Status.OK, gap_mm=1.5, run="a,b", input_mm=0.0)])
        table.add([GapRow(2, 0.08, Status.OK, gap_mm=-1e-9, input_mm=-0.0)])
    lines = (tmp_path / "gaps.csv").read_text().splitlines()
    assert lines[1] == "0,,touching" + "," * 19
    assert lines[3] == "2,0.08,ok,0" + "," * 18 + "0"  # a zero without a sign
    assert lines[2] == "1,0.04,ok,1.5" + "," * 17 + '"a,b",0'


@settings(max_examples=50, deadline=None)
@given(gap_mm=st.floats(-1e3, 1e3), time_s=st.floats(0.0, 1e6), run=st.text("ab,\"' é", max_size=5))
def test_values_survive_the_file(
    tmp_path_factory: pytest.TempPathFactory, gap_mm: float, time_s: float, run: str
) -> None:
    path = tmp_path_factory.mktemp("table") / "gaps.csv"
    with GapsCsv(path, ("run", "input_mm")) as table:
        table.add([GapRow(3, time_s, Status.OK, gap_mm=gap_mm, run=run)])
    (row,) = csv_rows(path)
    assert float(row["gap_mm"]) == pytest.approx(gap_mm, abs=MM_TOLERANCE)
    assert float(row["time_s"]) == pytest.approx(time_s, abs=1e-9)
    assert row["run"] == run
    assert row["u_gap_mm"] == ""


def test_a_full_disk_leaves_whole_rows_and_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "gaps.csv"
    rows = [GapRow(frame, 0.04 * frame, Status.OK, gap_mm=1.0 + frame) for frame in range(500)]
    table = GapsCsv(path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    # A limit on the size of files stops writing in the middle of a row, as a full disk does.
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, limits[1]))
    try:
        table.add(rows)
        with pytest.raises(
            FingervisionError, match=r"could not be written any further .* free disk space and measure again"
        ):
            table.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    text = path.read_text()
    assert text.endswith("\n")
    written = list(csv.DictReader(text.splitlines()))
    assert 10 < len(written) < 500
    assert [row["frame"] for row in written] == [str(frame) for frame in range(len(written))]
    assert all(row["right_mm"] == "" and row["gap_mm"] for row in written)
    table.close()


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"could not be written .* name another folder with --out"):
        GapsCsv(tmp_path / "nowhere" / "gaps.csv")


def test_a_growing_table_that_is_replaced_is_read_anew(tmp_path: Path) -> None:
    path = tmp_path / "gaps.csv"
    narrow = "frame,time_s,status,gap_mm\n" + "".join(f"{n},{n / 25},ok,{n}.5\n" for n in range(5))
    wide = "frame,time_s,status,gap_mm,run,input_mm\n" + "".join(
        f'{n},{n / 25},ok,{n}.5,"a,b",0.{n}\n' for n in range(7)
    )
    reader = GapsReader(path)
    assert not reader.refresh()
    path.write_text(narrow + "5,0.2,ok")
    assert not reader.refresh()
    assert [row.frame for row in reader.rows] == [0, 1, 2, 3, 4]
    path.write_text(narrow + "5,0.2,ok,5.5\n")
    assert not reader.refresh()
    assert [row.gap_mm for row in reader.rows] == [0.5, 1.5, 2.5, 3.5, 4.5, 5.5]
    for in_place in (False, True):
        before = path.with_name("other.csv")
        before.write_text(wide)
        if in_place:
            path.write_text(narrow)
            assert reader.refresh()
            path.write_text(wide)
        else:
            before.replace(path)
        assert reader.refresh()
        assert [(row.run, row.input_mm) for row in reader.rows] == [("a,b", n / 10) for n in range(7)]
        assert not reader.refresh()
    path.write_text(wide[: wide.index("3,")])  # truncated
    assert reader.refresh()
    assert len(reader.rows) == 3
    path.unlink()
    assert not reader.refresh()
    path.write_text(wide + "7,0.28,ok\n")
    for _ in range(2):  # nothing of a table that cannot be read is taken, however often it is tried
        with pytest.raises(DataError, match="6 cells"):
            reader.refresh()
        assert len(reader.rows) == 3


@pytest.mark.parametrize("begun", ["", "frame,time_s,sta"])
def test_a_table_that_was_met_before_its_header_is_read_once_it_is_there(tmp_path: Path, begun: str) -> None:
    path = tmp_path / "gaps.csv"
    path.write_text(begun)
    reader = GapsReader(path)
    assert not reader.refresh()
    with path.open("r+") as table:  # the same file, as the program goes on that writes it
        table.write("frame,time_s,status,gap_mm\n0,0.0,ok,0.5\n1,0.04,ok,0.6\n")
    assert not reader.refresh()
    assert [row.gap_mm for row in reader.rows] == [0.5, 0.6]
