"""A measured table repeats that the camera's response was assumed, as the summary of its measurement says."""

import json
from pathlib import Path

import pytest

from fingervision.storage.measured_table import read_measured_table

ROWS = "time_s,input_mm,gap_mm,u_shift_px\n" + "".join(f"{k},{0.1 * k},{1 + 0.1 * k},{2.2}\n" for k in range(8))


def notes_beside(folder: Path, summary: str | None, name: str = "gaps.csv") -> str:
    (folder / name).write_text(ROWS)
    if summary is not None:
        (folder / "summary.json").write_text(summary)
    return " ".join(read_measured_table(folder / name).notes)


def summary_of(*, known: object) -> str:
    settings = {"response": "srgb", "response_known": known}
    return json.dumps({"settings": settings, "scale": {"px_per_mm": 100.0}})


def test_an_assumed_response_is_repeated_with_its_size(tmp_path: Path) -> None:
    # 2.2 px at 100 px/mm.
    words = notes_beside(tmp_path, summary_of(known=False))
    assert "taken as srgb" in words
    assert "22 um" in words


@pytest.mark.parametrize(
    "summary", [summary_of(known=True), summary_of(known=None), "[]", "{", '{"settings": 1}', None]
)
def test_nothing_is_said_of_a_known_response_or_a_broken_summary(tmp_path: Path, summary: str | None) -> None:
    assert "response" not in notes_beside(tmp_path, summary)


def test_a_summary_of_another_table_is_not_read(tmp_path: Path) -> None:
    assert "response" not in notes_beside(tmp_path, summary_of(known=False), "other.csv")
