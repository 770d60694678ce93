"""`fingervision table`, columns.toml and --columns, as a user meets them."""

import json
import os
import re
import shutil
import time
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import DataError, NoCalibrationError, UsageError
from fingervision.tables.mapping import entry_for
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.read import read_drive, read_measured_table, read_model
from tests.commands import printed

HERE = Path(__file__).parents[2]
FOREIGN = HERE / "tests" / "storage" / "foreign"
TABLE1 = HERE / "sample_frames" / "paper" / "table1.csv"


def copied(name: str, folder: Path) -> Path:
    return Path(shutil.copy(FOREIGN / name, folder))


def test_what_was_understood_is_printed_and_written(tmp_path: Path) -> None:
    table = copied("german_logger.csv", tmp_path)
    said = printed("table", table)
    for words in ("cp1252", "semicolon", "decimal comma", "Weg [µm]", "input_mm", "24 rows", "10 rows a second"):
        assert words in said
    text = (tmp_path / "columns.toml").read_text(encoding="utf-8")
    assert 'file = "german_logger.csv"' in text
    assert 'columns.input = "Weg [µm]"' in text
    again = read_measured_table(table)
    assert any("columns.toml" in note for note in again.notes)
    assert "Unchanged" in printed("table", table)
    assert (tmp_path / "columns.toml").read_text(encoding="utf-8") == text


def test_a_range_is_printed_with_its_own_unit_beside_that_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(
        "Zeit [ms];Weg [µm];Abstand [mm]\n0;0;1,2\n100;10;1,3\n200;30;1,4\n", encoding="utf-8"
    )
    said = printed("table", tmp_path / "log.csv")
    assert re.search(r"Weg \[µm\] +µm +input_mm +0 to 0\.03 mm\n", said)
    assert re.search(r"Zeit \[ms\] +ms +time_s +0 to 0\.2 s\n", said)


def test_json_holds_what_is_printed(tmp_path: Path) -> None:
    document = json.loads(printed("table", copied("german_logger.csv", tmp_path), "--json"))
    assert document["kind"] == "measured"
    assert document["rate_hz"] == pytest.approx(10.0)
    assert {each["role"]: each["unit"] for each in document["columns"]} == {"time": "ms", "input": "µm", "gap": "mm"}
    assert document["open"] == []
    with pytest.raises(OpenQuestionError):
        printed("table", copied("several_models.csv", tmp_path), "--json")


def test_a_key_that_is_said_once_is_used_by_the_next_call_and_nothing_is_written_before(tmp_path: Path) -> None:
    table = copied("several_models.csv", tmp_path)
    with pytest.raises(OpenQuestionError, match=r"simmechanics_mm.*comsol_mm.*--set columns.gap="):
        printed("table", table)
    assert not (tmp_path / "columns.toml").exists()
    printed("table", table, "--set", "columns.gap=comsol_mm")
    assert read_model(table).base_path == str(table)
    # The same table as a measurement is another question.
    with pytest.raises(OpenQuestionError):
        read_measured_table(table)


def test_a_gap_over_the_input_without_times_is_said_once_for_a_measurement_and_for_a_simulation(tmp_path: Path) -> None:
    table = tmp_path / "curve.txt"
    rows = "".join(f"{0.1 * k:.1f} {4.2 + 0.77 * k:.2f}\n" for k in range(8))
    table.write_text("% Eingriff (mm)   Gap (mm)\n" + rows, encoding="utf-8")
    with pytest.raises(OpenQuestionError) as caught:
        printed("table", table)
    assert "--kind" not in str(caught.value)
    said = printed("table", table, "--set", caught.value.questions[0].key)
    assert "measured or simulation table" in said
    assert json.loads(printed("table", table, "--json"))["also"] == "simulation"
    np.testing.assert_allclose(read_measured_table(table).gap_mm, 4.2 + 0.77 * np.arange(8))
    np.testing.assert_allclose(read_model(table).base.respond(np.array([0.35])).gap_mm, 6.895)


def test_times_make_a_measured_table_of_it(tmp_path: Path) -> None:
    table = copied("inches.csv", tmp_path)
    assert json.loads(printed("table", table, "--json"))["also"] == ""
    assert 'as = "measured"' in (tmp_path / "columns.toml").read_text(encoding="utf-8")


def test_two_open_questions_suggest_two_columns(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("alpha,beta,gamma\n0,1,2\n1,2,3\n2,4,5\n", encoding="utf-8")
    with pytest.raises(OpenQuestionError, match=r"columns\.input=beta --set columns\.gap=gamma"):
        printed("table", tmp_path / "log.csv", "--as", "measured")


def test_the_papers_table_is_read_as_it_is(tmp_path: Path) -> None:
    """Gaps of the paper's Table 1 in mm, inputs from m."""
    table = Path(shutil.copy(TABLE1, tmp_path))
    rows = np.genfromtxt(table, delimiter=",", skip_header=1)
    measured = read_measured_table(table)
    np.testing.assert_allclose(measured.input_mm, 1e3 * rows[:, 0], atol=1e-12)
    np.testing.assert_allclose(measured.gap_mm, rows[:, 3], atol=1e-12)
    columns = tmp_path / "decided.toml"
    printed("table", table, "--as", "simulation", "--set", "columns.gap=comsol_mm", "--out", columns)
    out = tmp_path / "out"
    printed("compare", table, "--model", table, "--columns", columns, "--out", out)
    found = json.loads((out / "compare.json").read_text())["rms_mm"]
    difference = rows[:, 3] - rows[:, 2]
    assert found == pytest.approx(np.sqrt(np.mean(difference**2)), rel=0.15)


def test_entries_of_other_tables_and_comments_stay(tmp_path: Path) -> None:
    path = tmp_path / "columns.toml"
    mine = '# our bench\nschema = 1\n\n[[table]]\nfile = "other*.csv"  # all of Monday\nunits.input = "um"\n'
    path.write_text(mine, encoding="utf-8")
    printed("table", copied("german_logger.csv", tmp_path))
    printed("table", copied("labview_one_x.lvm", tmp_path))
    printed("table", tmp_path / "german_logger.csv", "--set", "units.gap=mm")
    text = path.read_text(encoding="utf-8")
    assert text.startswith(mine)
    assert text.count("[[table]]") == 3
    assert dict(entry_for(tmp_path / "other7.csv", "drive").units) == {"input": "um"}


def test_own_tables_are_read_to_the_letter_and_need_no_mapping(tmp_path: Path) -> None:
    table = tmp_path / "drive.csv"
    table.write_text("time_s,input_mm\n0,1\n1,1\n")
    assert "own format" in printed("table", table, "--as", "drive")
    assert not (tmp_path / "columns.toml").exists()
    assert read_drive(table).input_mm.tolist() == [1.0, 1.0]
    table.write_text("time_s,input_mm\n0,nan\n")
    with pytest.raises(DataError, match=r"input_mm must be .* in line 2"):
        read_drive(table)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[table]]\ncolums.gap = 'a'\n", "colums"),
        ("[[table]]\ndecimal = ';'\n", "decimal"),
        ("[[table]]\naccept = ['all']\n", "accept"),
        ("[[table]]\ncolumns.gap = 'Nothing'\n", "must name a column"),
        ("[[table]]\nheader_line = 7\n", "header_line"),
        ("table = 3\n", "table"),
        ("[[table\n", "TOML"),
    ],
)
def test_a_wrong_mapping_is_a_sentence(text: str, words: str, tmp_path: Path) -> None:
    table = copied("german_logger.csv", tmp_path)
    (tmp_path / "columns.toml").write_text(text)
    with pytest.raises(DataError, match=words):
        read_measured_table(table)


def test_an_input_that_is_missing_for_most_of_the_gaps_is_asked_about(tmp_path: Path) -> None:
    table = tmp_path / "half.csv"
    rows = [f"{k / 10},{k / 20 if k < 9 else ''},{4 + k / 2}" for k in range(24)]
    table.write_text("time [s],position [mm],gap [mm]\n" + "\n".join(rows) + "\n")
    with pytest.raises(OpenQuestionError, match="only 9 of 24 rows"):
        read_measured_table(table)
    printed("table", table, "--set", "accept=overlap")
    assert read_measured_table(table).gap_mm.size == 9


def test_a_picture_is_drawn(tmp_path: Path) -> None:
    printed("table", copied("labview_one_x.lvm", tmp_path), "--png", tmp_path / "t.png")
    assert (tmp_path / "t.png").read_bytes().startswith(b"\x89PNG")


def simulation(folder: Path) -> Path:
    path = folder / "model.csv"
    path.write_text("input_mm,gap_mm\n-2,-11.4\n2,19.4\n")
    return path


@pytest.mark.slow
def test_results_of_another_table_are_never_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first, second = copied("german_logger.csv", tmp_path), copied("spanish.csv", tmp_path)
    model = simulation(tmp_path)
    printed("compare", first, "--model", model)
    before = Path("comparison/compare.json").read_bytes()
    said = printed("compare", second, "--model", model)
    assert "comparison-spanish" in said
    assert Path("comparison/compare.json").read_bytes() == before
    assert Path("comparison-spanish/compare.json").exists()
    with pytest.raises(UsageError, match="holds the results of"):
        printed("compare", second, "--model", model, "--out", "comparison")
    assert Path("comparison/compare.json").read_bytes() == before
    printed("compare", second, "--model", model)
    printed("compare", first, "--model", model)
    assert sorted(path.name for path in tmp_path.glob("comparison*")) == ["comparison", "comparison-spanish"]


def test_a_model_leaves_no_part_of_an_earlier_answer(tmp_path: Path) -> None:
    gripper, out = HERE / "sample_frames" / "paper" / "gripper.toml", tmp_path / "out"
    printed("model", gripper, "--kind", "stiffness_matrix", "--out", out)
    for name in ("deformed.png", "notes.txt", "lumped"):
        (out / name).mkdir() if name == "lumped" else (out / name).write_text("old")
    (out / "lumped" / "simulation.csv").write_text("old")
    for stale in (out / "deformed.png", out / "lumped" / "simulation.csv"):
        os.utime(stale, ns=(time.time_ns() - 10**10,) * 2)
    printed("model", gripper, "--kind", "stiffness_matrix", "--out", out)
    assert not (out / "deformed.png").exists()
    assert not (out / "lumped" / "simulation.csv").exists()
    assert (out / "notes.txt").exists()
    assert (out / "simulation.csv").exists()


def gaps(folder: Path, name: str, values: np.ndarray) -> Path:
    path = folder / name
    path.write_text("frame,gap_mm,input_mm\n" + "".join(f"{k},{v:.6f},0.1\n" for k, v in enumerate(values)))
    return path


def test_a_moving_run_has_no_repeatability(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    held = [gaps(tmp_path, f"held{k}.csv", 4.0 + 0.0003 * rng.standard_normal(60)) for k in (1, 2)]
    assert "repeatability" in printed("calibrate", "repeat", *held, "--tolerance-mm", "0.02")
    moving = gaps(tmp_path, "moving.csv", 4.0 + 8.0 * np.sin(np.arange(60) / 9.0) + 0.0003 * rng.standard_normal(60))
    with pytest.raises(NoCalibrationError, match=r"moving\.csv.*range from"):
        printed("calibrate", "repeat", held[0], moving, "--tolerance-mm", "0.02")
