"""The error of the recorded input: after smoothing, it is as large as stated."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.motion.encoder import input_sigma
from fingervision.motion.local_polynomial_smoothing import SmoothedRecord, blended, smoothed
from fingervision.motion.log_path import LogPath

Array = NDArray[np.float64]
RATE_HZ = 8.0
SIGMA_MM = 1e-3
STEP_MM = 2e-3
HONEST = (0.6, 1.3)
"""Limits of the squared error divided by the error stated from the leverage: windows are selected from the data
themselves, and one formula is used for all motions."""


def _time_s(seconds: float) -> Array:
    return np.arange(int(seconds * RATE_HZ)) / RATE_HZ


def _motions() -> dict[str, tuple[Array, Array]]:
    t = _time_s(120.0)
    turns = np.interp(t, [0.0, 13.3, 40.1, 67.7, 95.2, 120.0], [0.0, 0.61, -0.58, 0.37, -0.11, 0.0])
    return {
        "straight, with turns": (t, turns),
        "a slow sine": (t, 0.5 * np.sin(2.0 * np.pi * 0.06 * t)),
        "a fast sine": (t, 0.15 * np.sin(2.0 * np.pi * 0.3 * t)),
        "a hold": (t, np.full(t.size, 0.12345)),
    }


@pytest.mark.parametrize("name", _motions())
def test_leverage_is_the_variance_that_is_left(name: str) -> None:
    t, true = _motions()[name]
    rng = np.random.default_rng(4)
    errors, claims = [], []
    for _ in range(20):
        found, leverage = smoothed(true + SIGMA_MM * rng.standard_normal(t.size), t, (slice(0, t.size),), SIGMA_MM, 0.0)
        errors.append(np.mean((found - true) ** 2) / SIGMA_MM**2)
        claims.append(np.mean(leverage))
    assert np.mean(errors) < 1.0, "smoothing makes nothing worse"
    assert HONEST[0] < np.mean(errors) / np.mean(claims) < HONEST[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", _motions())
def test_leverage_is_true_of_an_encoder(name: str) -> None:
    t, true = _motions()[name]
    rng = np.random.default_rng(5)
    errors, claims = [], []
    for _ in range(200):
        moved = true + rng.uniform(0.0, STEP_MM)
        recorded = STEP_MM * np.round(moved / STEP_MM)
        sigma, step = input_sigma(recorded, (slice(0, t.size),))
        if name == "a hold":
            sigma, step = STEP_MM / np.sqrt(12.0), STEP_MM  # one constant value does not show the step
        assert step == pytest.approx(STEP_MM)
        found, leverage = smoothed(recorded, t, (slice(0, t.size),), sigma, step)
        errors.append(np.mean((found - moved) ** 2) / (STEP_MM**2 / 12.0))
        claims.append(np.mean(leverage) * sigma**2 / (STEP_MM**2 / 12.0))
    # On a long line, rounding errors average out better than independent errors: the error is smaller than stated,
    # never larger.
    assert 0.3 < np.mean(errors) / np.mean(claims) < HONEST[1]


def test_samples_that_are_rounded_alike_are_not_averaged() -> None:
    t = _time_s(8.0)
    # The position advances by 5.01 steps per sample, so that the rounding error drifts by two thirds of a step over the
    # whole record.
    true = STEP_MM * (5.01 * np.arange(t.size) - 0.3)
    recorded = STEP_MM * np.round(true / STEP_MM)
    _, leverage = smoothed(recorded, t, (slice(0, t.size),), STEP_MM / np.sqrt(12.0), STEP_MM)
    assert np.median(leverage) > 0.5


@given(
    steps_per_sample=st.one_of(st.floats(0.1, 0.8), st.floats(2.1, 20.0).filter(lambda v: 0.05 < v % 1.0 < 0.95)),
    step_mm=st.floats(1e-4, 0.05),
    count=st.integers(100, 300),
)
@settings(deadline=None, max_examples=60)
def test_an_encoder_is_known_however_far_a_sample_goes(steps_per_sample: float, step_mm: float, count: int) -> None:
    recorded = np.round(step_mm * np.round(steps_per_sample * np.arange(count)), 9)
    sigma, step = input_sigma(recorded, (slice(0, count),))
    assert step == pytest.approx(step_mm, rel=1e-3)
    assert sigma == pytest.approx(step_mm / np.sqrt(12.0), rel=1e-3)


def test_an_exact_drive_with_holds_is_no_encoder() -> None:
    way = np.concatenate([np.zeros(40), 0.015 * np.arange(60), np.full(40, 0.885), 0.885 - 0.015 * np.arange(60)])
    assert input_sigma(np.round(way, 6), (slice(0, way.size),)) == (0.0, 0.0)


@pytest.mark.parametrize("spacing_mm", [0.05, 0.1, 0.02])
def test_set_points_in_round_numbers_are_no_encoder(spacing_mm: float) -> None:
    up = spacing_mm * np.arange(-10, 11)
    there_and_back = np.concatenate([up, up[-2::-1]])
    assert input_sigma(there_and_back, (slice(0, there_and_back.size),)) == (0.0, 0.0)


def test_noise_on_a_fine_grid_is_noise() -> None:
    t = _time_s(60.0)
    rng = np.random.default_rng(6)
    recorded = np.round(0.5 * np.sin(0.1 * t) + SIGMA_MM * rng.standard_normal(t.size), 5)
    sigma, step = input_sigma(recorded, (slice(0, t.size),))
    assert step == 0.0
    assert sigma == pytest.approx(SIGMA_MM, rel=0.15)


def test_an_exact_swing_has_no_error() -> None:
    t = _time_s(60.0)
    sigma, _ = input_sigma(0.15 * np.sin(2.0 * np.pi * 0.3 * t), (slice(0, t.size),))
    assert sigma < SIGMA_MM / 20.0


def test_blending_keeps_lines_and_takes_out_the_zigzag_of_an_encoder() -> None:
    rng = np.random.default_rng(8)
    t = np.cumsum(rng.uniform(0.05, 0.2, 300))
    whole = (slice(0, 300),)
    assert blended(0.3 * t, 0.3 * t, t, whole, np.full(300, 0.05)) == pytest.approx(0.3 * t, abs=1e-12)
    # At half a step per sample, the rounding error alternates, and so do the selected windows.
    t = np.arange(300.0)
    true = 0.503 * STEP_MM * t
    recorded = np.round(true / STEP_MM) * STEP_MM
    found, leverage = smoothed(recorded, t, whole, STEP_MM / np.sqrt(12.0), STEP_MM)
    rough, smooth = (np.std(np.diff(values - true)) for values in (found, blended(found, recorded, t, whole, leverage)))
    assert smooth < 0.7 * rough


def _play(path: Array, width: float) -> Array:
    """Play operator, point by point, engaged downwards at first."""
    out, at = np.empty_like(path), path[0] + 0.5 * width
    for i, x in enumerate(path):
        at = min(max(at, x - 0.5 * width), x + 0.5 * width)
        out[i] = at
    return out


def test_the_path_of_a_stage_at_rest_does_not_wander() -> None:
    """A play follows the farthest point of a wandering path, so that a noisy rest would look like a larger play."""
    t, rng = _time_s(60.0), np.random.default_rng(6)
    true = np.interp(t, [0.0, 10.0, 20.0, 25.0, 60.0], [0.0, 1.0, -0.4, 0.2, 0.2])
    rest = t > 26.0
    behind = []
    for _ in range(20):
        recorded = true + SIGMA_MM * rng.standard_normal(t.size)
        found = SmoothedRecord.of(recorded, t, (slice(0, t.size),)).path_mm
        behind.append(np.mean((_play(found, 0.02) - _play(true, 0.02))[rest]))
    assert abs(np.mean(behind)) < 3.0 * SIGMA_MM / np.sqrt(20.0 * rest.sum())


@pytest.mark.parametrize("order", ["noisy", "encoder"])
def test_a_stroke_that_turns_beside_a_rest_is_kept(order: str) -> None:
    # The stage leaves a rest downwards and turns within six rows: clipped as an overshoot, 0.15 mm of it were lost.
    time_s = np.arange(120) / 20.0
    path_mm = np.interp(time_s, [0.0, 1.0, 1.35, 2.35, 2.5, 2.8, 3.8, 4.5], [0.0, 0.0, 0.3, 0.3, 0.15, 0.45, 0.45, 0.0])
    noise_mm = 1e-4 * np.random.default_rng(3).standard_normal(time_s.size)
    read_mm = path_mm + noise_mm if order == "noisy" else 4e-4 * np.round(path_mm / 4e-4)
    path = LogPath.of(DriveHistory(time_s, read_mm))
    assert np.max(np.abs(np.interp(time_s, path.drive.time_s, path.drive.input_mm) - path_mm)) < 4e-4
