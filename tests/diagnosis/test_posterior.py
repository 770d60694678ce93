"""Uncertainties with known true values: of a mean, and of a parameter whose best value lies at its bound."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.posterior import settled
from fingervision.diagnosis.input.preparation import prepare
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model

EDGE_MM = 0.01
SAMPLES = 240
SEED = 4
WALK = 0.2
"""Relative tolerance: a random walk of a thousand steps determines a standard deviation to 10 %; twice that value."""


@pytest.fixture
def problem(tmp_path: Path) -> Problem:
    """One run to the end of the range and back without an effect; the noise is estimated with no effect."""
    rng = np.random.default_rng(SEED)
    u = 0.5 * np.sin(np.linspace(0.0, 12.0, SAMPLES))
    left, right = (side * (2.0 + 3.5 * u) + EDGE_MM * rng.standard_normal(SAMPLES) for side in (-1.0, 1.0))
    lines = [f"{0.1 * k},{u[k]},{right[k] - left[k]},{left[k]},{right[k]}" for k in range(SAMPLES)]
    (tmp_path / "measured.csv").write_text("time_s,input_mm,gap_mm,left_mm,right_mm\n" + "\n".join(lines) + "\n")
    (tmp_path / "sim.csv").write_text("input_mm,gap_mm\n-0.6,-0.2\n0.6,8.2\n")
    bench = prepare(read_measured_table(tmp_path / "measured.csv"), read_model(tmp_path / "sim.csv"))
    return bench.problem(bench.stacked_mm - bench.chain.stacked({}), 0, explained=True)


def settle(problem: Problem, name: str, parameter: str, start: float) -> tuple[Explanation, float]:
    best = fit(problem, (name,), {name: {parameter: start}}, iterations=20)
    answer, _ = settled(problem, best, np.random.default_rng(SEED))
    return answer, float(np.sqrt(answer.covariance[0, 0]))


def test_an_offset_is_as_uncertain_as_a_mean(problem: Problem) -> None:
    answer, u = settle(problem, "rest_gap_error", "offset_mm", 0.001)
    expected = np.sqrt(2.0) * EDGE_MM / np.sqrt(SAMPLES)
    assert u == pytest.approx(expected, rel=WALK)
    assert abs(answer.values["rest_gap_error"]["offset_mm"]) < 3.0 * expected


def test_a_play_of_nothing_is_not_known_exactly(problem: Problem) -> None:
    answer, u = settle(problem, "backlash", "play_mm", 1e-4)
    play_mm = answer.values["backlash"]["play_mm"]
    # Half of the play changes the gap by 7 mm per mm, and the mean over some 200 samples in motion shows 0.001 mm.
    assert 0.0 <= play_mm < 1e-3
    assert 5e-5 < u < 1e-3
