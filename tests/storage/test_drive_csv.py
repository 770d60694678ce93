"""drive.csv: read as written, and every bad table named by its line."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError, InputFileError
from fingervision.motion.drive_at import drive_at
from fingervision.storage.drive_csv import read_drive, write_drive_log
from fingervision.storage.measured_table import read_measured_table


def table(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_columns_may_stand_in_any_order_and_comments_are_left_out(tmp_path: Path) -> None:
    drive = read_drive(
        table(
            tmp_path / "drive.csv",
            "# bench 3\nrun,force_n,input_mm,time_s,note\na,0.5,1.25,0,x\n\n# pause\nb,1,-2,3.5,y\n",
        )
    )
    np.testing.assert_array_equal(drive.time_s, [0.0, 3.5])
    np.testing.assert_array_equal(drive.input_mm, [1.25, -2.0])
    assert drive.run == ("a", "b")
    assert drive.force_n is not None
    np.testing.assert_array_equal(drive.force_n, [0.5, 1.0])


def test_runs_and_force_may_be_missing(tmp_path: Path) -> None:
    drive = read_drive(table(tmp_path / "drive.csv", "time_s,input_mm\n0,1\n"))
    assert drive.run is None
    assert drive.force_n is None


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "must have a header line with time_s,input_mm"),
        ("time_s,input\n0,1\n", "must have a column input_mm, but has time_s,input"),
        ("time_s,input_mm\n", "must have at least one row below its header"),
        ("time_s,input_mm\n0,1\n1\n", "Line 3 of .* must have 2 cells .* but has 1"),
        ("# c\ntime_s,input_mm\n0,one\n", "input_mm must be a finite number, but is 'one' in line 3 of"),
        ("time_s,input_mm\n0,nan\n", "input_mm must be a finite number, but is 'nan' in line 2 of"),
        ("time_s,input_mm\n0,\n", "input_mm must be a number in every row, but line 2 of"),
        ("time_s,input_mm\n0,1\n0,2\n", "time_s must increase from row to row, but in line 3 of .* it is 0 after 0"),
        ("time_s,input_mm,run\n0,1,a\n1,1,b\n2,1,a\n", "but run a starts again in line 4"),
    ],
)
def test_a_bad_table_is_refused_in_a_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        read_drive(table(tmp_path / "drive.csv", text))


def test_what_is_no_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="There is no table"):
        read_drive(tmp_path / "drive.csv")
    (tmp_path / "drive.csv").write_bytes(b"\xff\xfe\x00\x81" * 10)
    with pytest.raises(DataError, match="must be a CSV table in UTF-8"):
        read_drive(tmp_path / "drive.csv")


def test_the_log_beside_a_table_is_read_while_the_table_has_its_inputs(tmp_path: Path) -> None:
    rng = np.random.default_rng(12)
    log = DriveHistory(np.cumsum(rng.uniform(0.05, 0.15, 60)), np.cumsum(rng.uniform(-0.1, 0.3, 60)), ("out",) * 60)
    write_drive_log(tmp_path / "drive_log.csv", log)
    times = np.arange(0.5, 3.0, 0.04)
    states = [drive_at(log, at_s) for at_s in times.tolist()]
    lines = [f"{at:.9f},{1.0 + s.input_mm:.7f},out,{s.input_mm:.7f}" for at, s in zip(times, states, strict=True) if s]
    text = "\n".join(["time_s,gap_mm,run,input_mm", *lines]) + "\n"
    table = tmp_path / "gaps.csv"
    table.write_text(text)
    found = read_measured_table(table).log
    assert found is not None
    np.testing.assert_allclose(found.time_s, log.time_s, atol=1e-9)
    np.testing.assert_array_equal(found.input_mm, log.input_mm)
    table.write_text(text.replace(",out,", ",back,"))
    assert read_measured_table(table).log is None
    table.write_text(text.replace(lines[7], f"{lines[7].rpartition(',')[0]},0.5"))
    assert read_measured_table(table).log is None
    (tmp_path / "other.csv").write_text(text)
    assert read_measured_table(tmp_path / "other.csv").log is None
