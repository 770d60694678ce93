"""Tables whose header or quotes say two things at once."""

from pathlib import Path

import pytest

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import read_columns


def test_a_column_that_stands_twice_is_refused(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text("input_mm,gap_mm,gap_mm\n0,1,2\n")
    with pytest.raises(DataError, match="gap_mm occurs twice"):
        read_columns(tmp_path / "table.csv", ("input_mm", "gap_mm"))


def test_a_quote_that_is_never_closed_swallows_no_rows(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text('input_mm,gap_mm,run\n0,1,"a\n1,2,a\n2,3,a\n')
    with pytest.raises(DataError, match="quote"):
        read_columns(tmp_path / "table.csv", ("input_mm", "gap_mm"), texts=("run",))


def test_quotes_that_are_closed_are_read(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text('input_mm,gap_mm,run\n0,1,"a ""b"", c"\n')
    table = read_columns(tmp_path / "table.csv", ("gap_mm",), texts=("run",))
    assert table.columns == {"gap_mm": ["1"], "run": ['a "b", c']}
    assert table.numbers("gap_mm").value.tolist() == [1.0]
