"""The commands effects, compare and diagnose: exact contents of files, and sentences for wrong requests."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.domain.errors import UsageError
from fingervision.effects import catalogue

SEED = 21
KEYS = {
    "schema", "verdict", "effects", "alternatives", "where", "disagreement", "smallest_seen", "unknown", "remaining",
    "next_run", "excluded", "model", "seconds",
}  # fmt: skip


@pytest.fixture
def tables(tmp_path: Path) -> tuple[Path, Path]:
    """Tables of a gripper whose gap is 0.1 mm too large, in two runs."""
    rng = np.random.default_rng(SEED)
    u = np.concatenate([np.linspace(-0.4, 1.4, 30), np.linspace(1.4, -0.4, 30)])
    rows = []
    for run in range(2):
        gap = 4.1 + 7.7 * u + 0.01 * rng.standard_normal(u.size)
        rows += [f"{run},{20.0 * run + 0.1 * k},{u[k]},{gap[k]}" for k in range(u.size)]
    measured, model = tmp_path / "measured.csv", tmp_path / "sim.csv"
    measured.write_text("run,time_s,input_mm,gap_mm\n" + "\n".join(rows) + "\n")
    model.write_text("# made up\ninput_mm,gap_mm\n-0.6,-0.62\n1.8,17.86\n")
    return measured, model


def test_diagnose_writes_what_the_design_lays_down(tables: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ["diagnose", str(tables[0]), "--model", str(tables[1]), "--out", str(out), "--without", "edge_bias"]
    done = CliRunner().invoke(cli, command)
    assert done.exit_code == 0, done.output
    report = json.loads((out / "report.json").read_text())
    assert set(report) >= KEYS
    assert report["verdict"] == "ambiguous"
    assert ["rest_gap_error"] in report["alternatives"]
    assert {"name": "edge_bias", "reason": "left out by request"} in report["excluded"]
    assert report["next_run"]["recipe"] == "next_run.toml"
    assert (out / "next_run.toml").exists()
    page = (out / "report.html").read_text()
    assert report["sentence"] in page
    # The chart library states its web address in its licence; nothing is loaded from there.
    assert not re.search(r"(?:src|href)=\"?http|url\(http|fetch\(|import\(", page)
    again = CliRunner().invoke(cli, ["compare", str(tables[0]), "--model", str(out / "model.toml"), "--out", str(out)])
    assert "nowhere differ by more than the noise" in again.output


@pytest.mark.slow
def test_an_answer_leaves_no_next_run_of_an_earlier_one(tables: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    for model in (tables[1], out / "model.toml"):
        done = CliRunner().invoke(cli, ["diagnose", str(tables[0]), "--model", str(model), "--out", str(out)])
        assert done.exit_code == 0, done.output
        asks = json.loads((out / "report.json").read_text())["next_run"] is not None
        assert asks is (model == tables[1])
        assert (out / "next_run.toml").exists() is asks


def test_a_folder_that_cannot_be_made_is_refused(tables: tuple[Path, Path]) -> None:
    for command in ("compare", "diagnose"):
        inside = tables[0] / "out"
        done = CliRunner().invoke(cli, [command, str(tables[0]), "--model", str(tables[1]), "--out", str(inside)])
        assert str(done.exception) == (
            f"The folder {inside} cannot be written (Not a directory): name another folder with --out."
        )


def test_compare_says_where_in_a_sentence(tables: tuple[Path, Path], tmp_path: Path) -> None:
    done = CliRunner().invoke(cli, ["compare", str(tables[0]), "--model", str(tables[1]), "--out", str(tmp_path)])
    assert "mm larger than simulated" in done.output
    assert (tmp_path / "compare.png").exists()


def test_a_misspelt_effect_is_wrong_usage_with_the_nearest() -> None:
    done = CliRunner().invoke(cli, ["effects", "backlsh"])
    assert isinstance(done.exception, UsageError)
    assert "did you mean backlash?" in str(done.exception)


def test_effects_lists_all_and_draws_one(tmp_path: Path) -> None:
    assert len(CliRunner().invoke(cli, ["effects"]).output.splitlines()) == len(catalogue())
    done = CliRunner().invoke(cli, ["effects", "backlash", "--figure", str(tmp_path / "play.png")])
    assert "play operator" in done.output
    assert (tmp_path / "play.png").read_bytes().startswith(b"\x89PNG")
