"""Evidence for effects: noise alone hardly ever has any, and effects that imitate others are dropped."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.diagnosis.inference.evidence import speaks_for
from fingervision.diagnosis.inference.explanation_candidates import single_effects
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit, scan
from fingervision.diagnosis.inference.model_adequacy import imitated, shapes_of
from fingervision.diagnosis.inference.probe_basis import probes
from fingervision.diagnosis.inference.signatures import signatures
from fingervision.diagnosis.input.preparation import prepare
from fingervision.effects.play_operator import play
from fingervision.effects.stick_slip import stick
from tests.diagnosis.tables import written

Array = NDArray[np.float64]
EDGE_MM = 0.01
SAMPLES = 160
SEED = 5
DRAWS = 20
KINK = 0.1
FORMS = {
    "encoder_cyclic_error": {"amplitude_mm": 0.02, "period_mm": 0.5, "phase_rad": 0.0},
    "lever_ratio_error": {"ratio": 0.01},
    "large_deflection": {"reach_mm": 6.0, "cross": 0.2},
}
"""Effects whose sum can imitate a kink."""


def stroke() -> Array:
    return np.asarray(0.5 * np.sin(np.linspace(0.0, 12.0, SAMPLES)))


def several_and_fewer(problem: Problem) -> tuple[Explanation, list[Explanation]]:
    fewer = [problem.nothing(), *(fit(problem, (name,), FORMS, iterations=30) for name in FORMS)]
    return fit(problem, tuple(FORMS), FORMS, iterations=30), fewer


def problem_of(folder: Path, away: Array) -> Problem:
    """One run to the end of the range and back, whose gap differs from that of the model by `away`."""
    rng = np.random.default_rng(SEED)
    u = stroke()
    left, right = (side * (2.0 + 3.5 * u + 0.5 * away) + EDGE_MM * rng.standard_normal(SAMPLES) for side in (-1, 1))
    lines = [f"{0.1 * k},{u[k]},{right[k] - left[k]},{left[k]},{right[k]}" for k in range(SAMPLES)]
    bench = prepare(*written(folder, "time_s,input_mm,gap_mm,left_mm,right_mm", lines, "-0.6,-0.2\n0.6,8.2"))
    # The noise is only that of the frames: it contains no part of the simulated effect.
    return bench.problem(EDGE_MM * rng.standard_normal((2, SAMPLES)).ravel(), 0, explained=True)


def claimed(problem: Problem, change: Array, rng: np.random.Generator) -> bool:
    """Whether effects are far more probable than none in a measurement that differs from the model by `change`."""
    measured = problem.whitened({}) + change + rng.standard_normal(problem.measured.size)
    drawn = replace(problem, measured=measured)
    return speaks_for(drawn, single_effects(drawn, signatures(drawn), 7, 1), drawn.nothing())


def test_noise_alone_is_hardly_ever_taken_for_an_effect(tmp_path: Path) -> None:
    problem, rng = problem_of(tmp_path, np.zeros(SAMPLES)), np.random.default_rng(SEED)
    assert sum(claimed(problem, np.zeros(2 * SAMPLES), rng) for _ in range(DRAWS)) == 0


@pytest.mark.parametrize("name", FORMS)
def test_an_effect_of_seven_standard_deviations_is_found(tmp_path: Path, name: str) -> None:
    problem, rng = problem_of(tmp_path, np.zeros(SAMPLES)), np.random.default_rng(SEED)
    change = problem.whitened({name: FORMS[name]}) - problem.whitened({})
    change *= 7.0 / np.sqrt(problem.offsets.squared(change, problem.offsets.metric((0.0, 0.0))))
    assert sum(claimed(problem, change, rng) for _ in range(5)) >= 4


def test_three_effects_that_imitate_a_kink_give_way_to_it(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, 0.3 * np.abs(stroke()))
    words = imitated(problem, shapes_of(problem), *several_and_fewer(problem))
    assert words is not None
    assert "kink" in words


def test_three_effects_that_are_there_imitate_nothing(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, np.zeros(SAMPLES))
    there = problem.measured + problem.whitened(FORMS) - problem.whitened({})
    problem = replace(problem, measured=there)
    assert imitated(problem, shapes_of(problem), *several_and_fewer(problem)) is None


def test_one_effect_that_imitates_a_kink_gives_way_to_it(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, KINK * np.maximum(stroke() - 0.1, 0.0))
    alone = fit(problem, ("large_deflection",), FORMS, iterations=30)
    words = imitated(problem, shapes_of(problem), alone, [problem.nothing()])
    assert words is not None
    assert "kink" in words


@pytest.mark.parametrize("name", FORMS)
def test_one_effect_that_is_there_imitates_nothing(tmp_path: Path, name: str) -> None:
    problem = problem_of(tmp_path, np.zeros(SAMPLES))
    there = problem.measured + problem.whitened({name: FORMS[name]}) - problem.whitened({})
    problem = replace(problem, measured=there)
    alone = fit(problem, (name,), FORMS, iterations=30)
    assert imitated(problem, shapes_of(problem), alone, [problem.nothing()]) is None


def jerking(folder: Path, jump_mm: float, play_mm: float) -> Problem:
    """A stage with play that moves in jumps between two rests; its input is recorded without error."""
    rng = np.random.default_rng(SEED)
    rate_hz, stand = 10.0, 80
    way = np.concatenate([np.linspace(0.0, 0.5, 150), np.full(stand, 0.5), np.linspace(0.5, -0.3, 220)])
    u = np.concatenate([way, np.full(stand, -0.3), np.linspace(-0.3, 0.1, 120)])
    t = np.arange(u.size) / rate_hz
    jumped = stick(play(u, play_mm, 0.0), jump_mm)
    left, right = (side * (2.0 + 3.5 * jumped) + EDGE_MM * rng.standard_normal(u.size) for side in (-1, 1))
    lines = [f"{t[k]},{u[k]},{right[k] - left[k]},{left[k]},{right[k]}" for k in range(u.size)]
    bench = prepare(*written(folder, "time_s,input_mm,gap_mm,left_mm,right_mm", lines, "-0.6,-0.2\n0.6,8.2"))
    return bench.problem(bench.stacked_mm - bench.chain.stacked({}), 0, explained=False)


def test_jumps_are_no_noise_where_the_stage_stands(tmp_path: Path) -> None:
    problem = jerking(tmp_path, 0.03, 0.0)
    assert problem.whitener.noises[0].total_mm == pytest.approx(np.sqrt(2.0) * EDGE_MM, rel=0.25)


def test_a_jump_is_tried_where_the_play_lets_it_come(tmp_path: Path) -> None:
    problem = jerking(tmp_path, 0.03, 0.02)
    sizes = [{"jump_mm": float(size)} for size in np.geomspace(0.005, 0.1, 200)]
    beside, alone = (
        scan(problem, fit(problem, tuple(values), values, iterations=0), "stick_slip", sizes)
        for values in ({"backlash": {"play_mm": 0.02}}, {})
    )
    assert beside[0]["jump_mm"] == pytest.approx(0.03, rel=0.02)
    assert abs(alone[0]["jump_mm"] / 0.03 - 1.0) > 0.1
    assert beside[1] < 0.2 * alone[1]


def test_waves_are_told_in_seconds_also_where_each_run_begins_at_zero(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, np.zeros(SAMPLES))
    half = SAMPLES // 2
    once = replace(problem.chain.history, runs=(slice(0, half), slice(half, SAMPLES)))
    again = replace(once, time_s=np.tile(0.1 * np.arange(half), 2), shared_clock=False)
    for history in (once, again):
        words = probes(history, problem.whitener, 10_000).words
        told = [re.search(r"over time with a period of (\S+) s in the gap", each) for each in words]
        periods_s = [float(each[1]) for each in told if each]
        assert max(periods_s) == pytest.approx(0.1 * (SAMPLES - 1), rel=5e-3)  # periods are printed with three digits
        assert min(periods_s) > 2.0 * 0.1
