"""Foreign tables are read to the same numbers as their truth, or refused with the key that decides."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import DataError
from fingervision.tables.mapping import entry_of_settings, entry_text
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.read import read_drive, read_measured_table, read_simulation_table
from tests.storage.foreign.binary import ASKED, READ, TRUTH
from tests.storage.foreign.truth import Truth, truths

# Digits of the printed numbers times an exact factor: the rest is the rounding of floating-point numbers.
SAME_MM = 1e-9
# Seconds since 1904 are 3.8e9: two neighbouring floating-point numbers are 4.8e-7 s apart there,
# days since 1900 6e-7 s.
SAME_EPOCH_S = 5e-7
TRUTHS = truths()


def read(table: Path, kind: str) -> dict[str, np.ndarray]:
    if kind == "drive":
        drive = read_drive(table)
        return {
            "time_s": drive.time_s,
            "input_mm": drive.input_mm,
            **({"force_n": drive.force_n} if drive.force_n is not None else {}),
        }
    if kind == "simulation":
        model = read_simulation_table(table)
        lower, upper = model.input_range_mm
        inputs = np.linspace(lower, upper, 7)
        return {"input_mm": inputs, "gap_mm": model.respond(inputs).gap_mm}
    measured = read_measured_table(table)
    found = {"input_mm": measured.input_mm, "gap_mm": measured.gap_mm, "runs": np.array(len(measured.runs))}
    if measured.time_s is not None:
        found["time_s"] = measured.time_s
    return found


def check(truth: Truth, found: dict[str, np.ndarray]) -> None:
    numbers = {name: np.array(list(map(float, cells))) for name, cells in truth.columns.items() if name != "run"}
    if truth.kind == "simulation":
        order = np.argsort(numbers["input_mm"])
        want = np.interp(found["input_mm"], numbers["input_mm"][order], numbers["gap_mm"][order])
        np.testing.assert_allclose(found["gap_mm"], want, atol=SAME_MM)
        assert found["input_mm"][0] == pytest.approx(numbers["input_mm"].min())
        assert found["input_mm"][-1] == pytest.approx(numbers["input_mm"].max())
        return
    if "run" in truth.columns:
        assert found["runs"] == len(set(truth.columns["run"]))
    assert set(numbers) <= set(found)
    for name, values in numbers.items():
        on_epoch = name == "time_s" and truth.table.stem.startswith(("unix", "labview_seconds", "spreadsheet"))
        same = SAME_EPOCH_S if on_epoch else SAME_MM
        np.testing.assert_allclose(found[name], values, atol=same, rtol=1e-12, err_msg=name)


@pytest.mark.parametrize("truth", TRUTHS, ids=lambda truth: truth.table.stem)
def test_a_foreign_table_is_read_to_its_truth_or_asks_for_the_key_that_decides(truth: Truth, tmp_path: Path) -> None:
    table = tmp_path / truth.table.name
    shutil.copy(truth.table, table)
    kind = "measured" if truth.kind == "iso" else truth.kind
    if truth.refused:
        with pytest.raises((DataError, OpenQuestionError), match=truth.refused):
            read(table, kind)
        return
    if truth.asks:
        with pytest.raises(OpenQuestionError) as caught:
            read(table, kind)
        keys = [question.key for question in caught.value.questions]
        assert any(key.startswith(truth.asks) for key in keys) or truth.asks in str(caught.value)
        # Only what is open is asked.
        assert len(keys) <= len(truth.states)
        entry = entry_of_settings(truth.states, tmp_path / "columns.toml")
        (tmp_path / "columns.toml").write_text("schema = 1\n" + entry_text(table.name, kind, entry), encoding="utf-8")
    check(truth, read(table, kind))


def check_binary(table: Path) -> None:
    found = read(table, "measured")
    for name, values in TRUTH.items():
        # Whole microseconds are what a sheet's date holds.
        same = 1e-6 if name == "time_s" and table.suffix == ".xlsx" else SAME_MM
        np.testing.assert_allclose(found[name], values, atol=same, rtol=1e-12, err_msg=name)


@pytest.mark.parametrize("make", READ, ids=lambda make: make.__name__)
def test_a_binary_table_is_read_to_its_truth(make: Callable[[Path], Path], tmp_path: Path) -> None:
    check_binary(make(tmp_path))


@pytest.mark.parametrize(("make", "key", "states"), ASKED, ids=lambda each: getattr(each, "__name__", ""))
def test_a_binary_table_that_leaves_something_open_asks_for_the_key(
    make: Callable[[Path], Path], key: str, states: tuple[str, ...], tmp_path: Path
) -> None:
    table = make(tmp_path)
    with pytest.raises(OpenQuestionError) as caught:
        read(table, "measured")
    assert any(question.key.startswith(key) for question in caught.value.questions)
    entry = entry_of_settings(states, tmp_path / "columns.toml")
    (tmp_path / "columns.toml").write_text("schema = 1\n" + entry_text(table.name, "measured", entry), encoding="utf-8")
    check_binary(table)


def test_the_collection_is_large() -> None:
    assert len(TRUTHS) + len(READ) + len(ASKED) >= 100
