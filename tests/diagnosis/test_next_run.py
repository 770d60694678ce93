"""The proposed next run: the predicted gain is reached, and effects that no motion can distinguish are reported."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.design.augmented_dataset import AugmentedDataset
from fingervision.diagnosis.design.expected_gain import MOST, expected_gain
from fingervision.diagnosis.design.next_look import checks_between, further_evidence
from fingervision.diagnosis.design.next_run import NEEDED, next_run
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.posterior import draws
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.preparation import prepare
from fingervision.diagnosis.noise.restricted_likelihood import drawn_noises
from fingervision.domain.effect import Array
from tests.diagnosis.tables import written

EDGE_MM = 0.003
SHARE = 0.01
STEP_S = 0.25
ONE_WAY = np.linspace(-0.5, 1.5, 40)
BACK = np.concatenate([np.linspace(1.4, -0.4, 20), np.linspace(-0.4, 1.4, 20)])


def measured(u: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Positions of the left and right finger; one finger opens more than the other finger."""
    opening = 7.0 * u
    left, right = (side * (2.0 + 0.5 * opening) + SHARE * opening for side in (-1.0, 1.0))
    return left + EDGE_MM * rng.standard_normal(u.size), right + EDGE_MM * rng.standard_normal(u.size)


def bench(folder: Path, seed: int) -> tuple[Observations, Problem]:
    left, right = measured(ONE_WAY, np.random.default_rng(seed))
    lines = [f"{STEP_S * k},{u},{r - x},{x},{r}" for k, (u, x, r) in enumerate(zip(ONE_WAY, left, right, strict=True))]
    data = prepare(*written(folder, "time_s,input_mm,gap_mm,left_mm,right_mm", lines, "-0.6,-0.2\n1.6,15.2"))
    alone = data.problem(data.stacked_mm - data.chain.stacked({}), 0, explained=False)
    best = explained(alone, "assembly_asymmetry", share=SHARE)
    return data, data.problem(data.stacked_mm - data.chain.stacked(best.values), 1, explained=True)


def explained(problem: Problem, name: str, **start: float) -> Explanation:
    return fit(problem, (name,), {name: start}, iterations=12)


def both(problem: Problem) -> tuple[Explanation, Explanation]:
    return (
        explained(problem, "assembly_asymmetry", share=SHARE),
        explained(problem, "camera_drift", rate_mm_per_s=0.002),
    )


@pytest.mark.parametrize("seed", [1, 2])
def test_what_comes_lies_in_the_promised_interval(tmp_path: Path, seed: int) -> None:
    data, problem = bench(tmp_path, seed)
    pair = both(problem)
    rng = np.random.default_rng(seed)
    found = (draws(problem, pair[0], rng), draws(problem, pair[1], rng))
    gain, (low, high) = expected_gain(data, problem, BACK, pair, (1.0, 0.0), found, rng)
    run = AugmentedDataset.of(data, problem, BACK)
    left, right = measured(BACK, rng)
    shown = np.stack([right - left, 0.5 * (left + right)])
    target = run.both.whitener.one(np.concatenate([data.aim_mm.reshape(2, -1), shown], axis=1).ravel())
    none = (0.0, 0.0)
    after = run.score(target, pair[1], [pair[1].values], none) - run.score(target, pair[0], [pair[0].values], none)
    came = after - (pair[1].score - pair[0].score)
    assert low <= gain < high
    assert gain <= max(low, MOST)
    assert low < came < high


def test_the_data_stay_as_they_were_and_the_run_is_as_foretold(tmp_path: Path) -> None:
    data, problem = bench(tmp_path, 1)
    run = AugmentedDataset.of(data, problem, BACK)
    truth = {"assembly_asymmetry": {"share": SHARE}}
    far = run.expected(truth).reshape(2, -1) - run.both.whitened(truth).reshape(2, -1)
    n = ONE_WAY.size
    assert np.allclose(far[:, n:], 0.0, atol=1e-9)
    assert np.allclose(far[:, :n].ravel(), problem.measured - problem.whitened(truth), atol=1e-9)


def test_a_run_is_proposed_that_settles_the_pair(tmp_path: Path) -> None:
    data, problem = bench(tmp_path, 1)
    pair = list(both(problem))
    rng = np.random.default_rng(1)
    proposal = next_run(data, problem, pair, draws(problem, pair[0], rng), rng)
    assert proposal is not None
    assert set(proposal.separates) == {"assembly_asymmetry", "camera_drift"}
    assert proposal.gain > NEEDED
    assert proposal.gain_interval[0] <= proposal.gain < proposal.gain_interval[1]


def test_exact_look_alikes_get_advice_and_no_run(tmp_path: Path) -> None:
    data, problem = bench(tmp_path, 1)
    pair = [
        explained(problem, "input_scale", ratio=0.01),
        explained(problem, "lever_ratio_error", ratio=0.01),
    ]
    rng = np.random.default_rng(1)
    assert next_run(data, problem, pair, draws(problem, pair[0], rng), rng) is None
    (sentence,) = further_evidence(tuple(pair))
    assert sentence.startswith("input_scale or lever_ratio_error: measure the stage's travel with a gauge")


# Pairs of effects that are identical for a straight model line, and pairs of an effect of the camera and one of the
# mechanism.
LOOK_ALIKES = [
    ("rest_gap_error", "edge_bias"), ("lever_ratio_error", "scale_error"), ("rest_gap_error", "scale_error"),
    ("assembly_asymmetry", "camera_tilt"), ("assembly_asymmetry", "camera_drift"), ("end_stop", "finger_contact"),
    ("large_deflection", "lens_distortion"), ("out_of_plane_motion", "lens_distortion"),
    ("drive_lag", "camera_latency"), ("rest_gap_error", "input_offset"), ("lever_ratio_error", "input_scale"),
]  # fmt: skip


@pytest.mark.parametrize("pair", LOOK_ALIKES)
def test_look_alikes_of_a_straight_line_have_a_check_that_tells_them_apart(pair: tuple[str, str]) -> None:
    assert len(checks_between(*pair)) == 1
    assert checks_between(*pair) == checks_between(*reversed(pair))


def test_drawn_noise_is_spread_as_a_variance_of_so_few_samples_is() -> None:
    rng = np.random.default_rng(3)
    white = [rng.standard_normal(40) for _ in range(2)]
    aside = [np.zeros(40, dtype=bool)] * 2
    noises = drawn_noises(white, (slice(0, 40),), aside, 2000, rng)
    level = np.array([noise[0].total_mm for noise in noises if noise[0].correlation < 0.01])
    # The prior probability of white noise is one half, and the data do not contradict it.
    assert level.size > 1000
    # The relative standard deviation of an estimated standard deviation is 1 / sqrt(2 (n - 2)); 2000 draws determine it
    # to a few per cent.
    assert np.std(level) / np.mean(level) == pytest.approx(1.0 / np.sqrt(2.0 * 38.0), rel=0.15)


def test_a_re_zeroed_stage_tells_its_own_offset_from_the_rest_gap(tmp_path: Path) -> None:
    data, problem = bench(tmp_path, 1)
    offset = {"input_offset": {"offset_mm": 0.02}}
    moved = [
        AugmentedDataset.of(data, problem, BACK, rezeroed=rezeroed).both.chain.respond(offset).gap_mm[ONE_WAY.size :]
        for rezeroed in (False, True)
    ]
    assert np.allclose(moved[0] - moved[1], 7.0 * 0.02)
    again = AugmentedDataset.of(data, problem, BACK, rezeroed=True)
    gap = explained(problem, "rest_gap_error", offset_mm=0.14)
    assert again.distance(offset, gap) > AugmentedDataset.of(data, problem, BACK).distance(offset, gap) + NEEDED


def test_only_a_stop_that_was_not_seen_goes_on_with_the_range(tmp_path: Path) -> None:
    data, problem = bench(tmp_path, 1)
    run = AugmentedDataset.of(data, problem, np.linspace(-0.5, 2.0, 40))
    (upper,) = (p.upper for where, p in problem.parameters(("end_stop",)) if p.name == "upper_mm")
    (further,) = (p.upper for where, p in run.both.parameters(("end_stop",)) if p.name == "upper_mm")
    assert further > upper
    seen = {"end_stop": {"lower_mm": -0.4, "upper_mm": upper - 0.01 * (ONE_WAY[-1] - ONE_WAY[0])}}
    assert run.moved(("end_stop",), seen) == seen
    unseen = {"end_stop": {"lower_mm": -0.4, "upper_mm": upper}}
    assert run.moved(("end_stop",), unseen)["end_stop"] == {"lower_mm": -0.4, "upper_mm": further}
