"""The record of a staircase has noise at rest, which no effect may explain, and corners, which no noise may explain."""

import numpy as np
import pytest

import fingervision as fv
from fingervision.domain.effect import History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.effects import catalogue
from fingervision.interface.column_tables import measured_from_columns
from fingervision.models.table import TableModel
from fingervision.motion.recorded_input import RecordedInput

SLOPE, NOISE_MM, RECORD_MM, ROWS = 7.72, 3e-4, 5e-5, 225
MODEL = {"input_mm": [-0.1, 0.6], "gap_mm": [1.0 - 0.1 * SLOPE, 1.0 + 0.6 * SLOPE]}


def staircase(rng: np.random.Generator) -> np.ndarray:
    """Steps of 40 to 60 um up and down, each with four rows at rest and two in motion."""
    levels = np.concatenate(
        [rng.uniform(0.04, 0.06) * np.array([0, 1, 2, 3, 4, 5, 6, 5, 4, 3, 2, 1]) for _ in range(4)]
    )
    place = np.arange(ROWS) / 6.0
    return np.interp(place, np.repeat(np.arange(48), 2) + np.tile([0.0, 0.5], 48), np.repeat(levels, 2))


def table(seed: int, ripple_mm: float = 0.0) -> MeasuredTable:
    rng = np.random.default_rng(seed)
    input_mm = staircase(rng) if not ripple_mm else 0.25 * (1.0 - np.cos(np.arange(ROWS) / 20.0))
    moved = input_mm + ripple_mm * np.sin(2.0 * np.pi * input_mm / 0.11)
    return measured_from_columns(
        {
            "time_s": (np.arange(ROWS) / 25.0).tolist(),
            "input_mm": (input_mm + rng.normal(0.0, RECORD_MM, ROWS)).tolist(),
            "gap_mm": (1.0 + SLOPE * moved + rng.normal(0.0, NOISE_MM, ROWS)).tolist(),
            "u_random_mm": [NOISE_MM] * ROWS,
        }
    )


def test_the_noise_among_real_motion_is_estimated() -> None:
    model = TableModel("line", np.array([-0.1, 0.6]), np.array([-0.1, -2.8]), np.array([0.128, 2.832]))
    found = [RecordedInput.of(table(seed), model, (-0.1, 0.6)) for seed in range(40)]
    seen_um = [1e3 * one.sigma_mm for one in found if one.is_motion]
    assert seen_um, "smoothing rounds corners, which the gap follows"
    # The share of noise is small beside that of the corners: a single estimate is known to a factor of two.
    assert 0.5e3 * RECORD_MM < np.median(seen_um) < 2e3 * RECORD_MM


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_named_in_a_staircase_with_nothing_hidden(seed: int) -> None:
    assert fv.diagnose(table(seed), MODEL).effects == ()


def test_a_ripple_is_named_beside_the_noise_of_the_record() -> None:
    found = fv.diagnose(table(3, ripple_mm=5e-4), MODEL)
    assert [effect.name for effect in found.effects] == ["encoder_cyclic_error"]
    assert found.effects[0].parameters["period_mm"].value == pytest.approx(0.11, rel=0.02)


def history(input_mm: np.ndarray, *, timed: bool = True) -> History:
    time_s = np.arange(input_mm.size) / 10.0 if timed else None
    return History(input_mm, time_s, (slice(0, input_mm.size),), 1.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("input_mm", "step_mm"),
    [
        (np.linspace(0.0, 1.0, 201), 0.005),
        (np.concatenate([np.linspace(0.0, 1.0, 201), np.linspace(1.0, 0.0, 6)]), 0.005),  # slowly out, fast back
        (np.repeat(np.linspace(0.0, 1.0, 11), 30) + np.tile(1e-5 * np.sin(np.arange(30) ** 2), 11), 0.1),
    ],
)
def test_places_are_resolved_by_the_shortest_step_over_them(input_mm: np.ndarray, step_mm: float) -> None:
    one = history(input_mm)
    assert one.resolved_mm == pytest.approx(step_mm, rel=1e-3)
    assert history(np.random.default_rng(1).permutation(input_mm), timed=False).resolved_mm <= 1.001 * step_mm
    _, period, _ = catalogue()["encoder_cyclic_error"].search(one)
    assert period.lower == pytest.approx(4.0 * step_mm, rel=1e-3)
