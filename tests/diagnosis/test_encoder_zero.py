"""An encoder whose zero lies anywhere within a step, in front of a play: both are told beside its roundings."""

import json
from pathlib import Path

import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.report import Verdict
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.benchmarks.world.draw import draw_table

SEED = 811
"""A seed for building: its table 11 was answered `unknown` while roundings counted as structure."""


@pytest.mark.slow
def test_an_offset_within_half_a_step_is_told_beside_the_play(tmp_path: Path) -> None:
    # 7.6 um of a 30 um step: a step over the input behind the first line gained more than the offset did.
    draw_table("encoder_bar", SEED, 11, tmp_path)
    folder = tmp_path / "encoder_bar_11"
    hidden = {h["name"] for h in json.loads((folder / "truth.json").read_text(encoding="utf-8"))["hidden"]}
    report = diagnose(read_measured_table(folder / "measured.csv"), read_model(folder / "simulation.csv")).report
    assert hidden == {"input_offset", "backlash"}
    assert report.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert hidden in [set(names) for names in report.alternatives]
