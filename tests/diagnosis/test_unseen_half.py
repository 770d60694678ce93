"""A name must predict the half that it was not fitted to, and an answer always says what to do next."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.design.next_look import lacking, next_look
from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.inference.held_out_prediction import fails_on_unseen_half, left_out_rms_mm
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.search import problem_of
from fingervision.diagnosis.inference.verdict import resembling
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.preparation import prepare
from fingervision.diagnosis.report.sentences import tried
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.report import Verdict
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.benchmarks.hidden import rows
from tests.benchmarks.hidden.experiment import draw_experiment
from tests.benchmarks.hidden.experiment_files import write
from tests.benchmarks.hidden.table_cache import TRIES

ROWS, NOISE_MM = 60, 0.002


def observed(ratios: tuple[float, ...], seed: int = 5) -> Observations:
    """Strokes there and back, one a run, whose gap moves by a ratio too far in each run."""
    rng = np.random.default_rng(seed)
    stroke = 1.0 - np.abs(np.linspace(-1.0, 1.0, ROWS))
    u = np.tile(stroke, len(ratios))
    gap = 3.0 + np.concatenate([(1.0 + ratio) * 5.0 * stroke for ratio in ratios])
    runs = tuple(slice(k * ROWS, (k + 1) * ROWS) for k in range(len(ratios)))
    time_s = 0.1 * np.arange(u.size)
    names = tuple(str(k) for k in range(len(ratios)))
    table = MeasuredTable(u, gap + NOISE_MM * rng.standard_normal(u.size), None, time_s, runs, names)
    at = np.linspace(-0.5, 1.5, 5)
    half = 0.5 * (3.0 + 5.0 * at)
    return prepare(table, CorrectedModel("line", TableModel("line", at, -half, half), "line.csv", (-0.5, 1.5), {}))


@pytest.mark.parametrize(
    ("ratios", "fails"), [((0.02, 0.02), False), ((0.02,), False), ((0.02, -0.02, 0.02, -0.015), True)]
)
def test_a_ratio_predicts_the_runs_that_share_it(ratios: tuple[float, ...], fails: bool) -> None:
    data = observed(ratios)
    problem = problem_of(data, None)
    # The second of two contrary runs is not foretold by a ratio that was fitted to the first.
    explanation = fit(problem, ("lever_ratio_error",), {"lever_ratio_error": {"ratio": 0.015}})
    words = fails_on_unseen_half(data, problem, explanation)
    assert (words is not None) == fails
    if words is not None:
        assert words.startswith("lever_ratio_error, fitted to every other run, predicts the runs between them worse")
    before, after = left_out_rms_mm(data, problem, explanation)
    if len(ratios) == 1:
        assert before is None
    elif before is not None and after is not None and not fails:
        assert after < 0.2 * before


def test_there_is_always_a_next_step() -> None:
    data = observed((0.02,))
    assert "measure both fingers" in " ".join(lacking(data))
    for verdict in Verdict:
        assert len(next_look(data, verdict, None, (), mistaken=False)) > 40
    timeless = replace(data, chain=replace(data.chain, history=replace(data.chain.history, time_s=None)))
    assert "time_s" in next_look(timeless, Verdict.UNKNOWN, None, (), mistaken=False)
    assert "question about the table" in next_look(data, Verdict.UNKNOWN, None, (), mistaken=True)


def test_noise_seldom_resembles_itself_and_structure_does() -> None:
    rng = np.random.default_rng(2)
    u = np.linspace(0.0, 1.0, 40)
    # Two orders of the rows are looked at, each at 5 %.
    assert np.mean([resembling(rng.standard_normal(40), rng.permutation(u)) for _ in range(400)]) < 0.12
    assert resembling(np.sin(6.0 * u) + 0.3 * rng.standard_normal(40), u)
    shuffled = rng.permutation(40)
    assert resembling((np.sin(6.0 * u) + 0.3 * rng.standard_normal(40))[shuffled], u[shuffled])


def test_the_sentence_on_what_was_tried_names_what_explains_a_part() -> None:
    parts = ({"effects": ["backlash"], "explained_share": 0.68}, {"effects": ["drive_lag"], "explained_share": 0.01})
    assert "backlash 68 %" in tried(parts)
    assert "drive_lag" not in tried(parts)
    assert "no single effect" in tried(parts[1:])


def test_a_half_that_determines_nothing_refutes_nothing(tmp_path: Path) -> None:
    # Half of this table leaves the radius of a large deflection open by its hundredfold.
    write(draw_experiment(1491 * 10_000 * TRIES, rows.ROWS["poor"]), tmp_path)
    done = diagnose(read_measured_table(tmp_path / "measured.csv"), read_model(tmp_path / "simulation.csv"))
    assert done.report.verdict is Verdict.NAMED
    assert done.report.alternatives == (("large_deflection",),)
