"""The table of all results: a name is text, a number is a number, whatever a spreadsheet takes them for."""

import csv
import io
from pathlib import Path

import pytest

from fingervision.batch.overview import reduction_of, table_text
from fingervision.batch.task import Digest, Outcome

COLUMN = reduction_of("measure").COLUMNS[0]


def first_line(name: str, cell: float | str | None = None, words: str = "") -> dict[str, str]:
    digest = Digest(cells={COLUMN: cell}, curve=(), caption="")
    outcome = Outcome(name, None, 0, words, digest, seconds=1.0)
    (line,) = csv.DictReader(io.StringIO(table_text(Path("out"), reduction_of("measure"), [outcome])))
    return line


@pytest.mark.parametrize("name", ['=HYPERLINK("http://evil.example";"x").mkv', "+1.mkv", "-1.mkv", "@SUM(1).mkv"])
def test_a_name_that_begins_like_a_formula_is_text(name: str) -> None:
    line = first_line(name, cell=name, words=name)
    assert [line["input"], line[COLUMN], line["words"]] == [f"'{name}"] * 3


def test_a_negative_number_is_no_formula() -> None:
    assert first_line("a.mkv", cell=-0.25)[COLUMN] == "-0.25"
    assert first_line("a.mkv")[COLUMN] == ""
