"""Penalties of start states (at an end, between the ends, alike in runs that are alike) and of places."""

from math import factorial
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.diagnosis.inference.parameter_priors import START_VARIANCE, inner_price, places_price, starts_price
from fingervision.domain.parameter import Parameter
from fingervision.effects.play_operator import play
from tests.diagnosis.tables import written

ROWS = 75


def states(count: int) -> list[tuple[str, Parameter]]:
    return [("backlash", Parameter(f"start_{r}", "", -1.0, 1.0, "state", run=r, at_ends=True)) for r in range(count)]


@pytest.mark.parametrize("runs", [1, 2, 15])
def test_runs_that_begin_at_one_end_have_the_probability_of_the_urn(runs: int) -> None:
    price = starts_price(states(runs), np.ones(runs), np.full(runs, 1e12), 10**9)
    assert price == pytest.approx(-2.0 * np.log(2.0 * factorial(runs) / factorial(runs + 2)), abs=1e-3)


def test_a_place_costs_the_share_of_its_range() -> None:
    place = [("end_stop", Parameter("upper_mm", "mm", 0.0, 10.0, "stop", place=True))]
    width_mm = np.sqrt(2.0 * np.pi) * 1e-3
    price = places_price(place, np.array([[1e-6]]), ROWS) + float(np.log(ROWS))
    assert price == pytest.approx(2.0 * np.log(10.0 / width_mm))
    assert places_price(place, np.zeros((1, 1)), ROWS) == 0.0


def test_a_state_that_no_row_shows_costs_nothing() -> None:
    assert starts_price(states(3), np.zeros(3), np.zeros(3), ROWS) == pytest.approx(0.0, abs=1e-12)


def test_a_state_between_the_ends_costs_its_width_beside_the_choice() -> None:
    bend = np.array([50.0])
    price = starts_price(states(1), np.zeros(1), bend, ROWS)
    assert price == pytest.approx(2.0 * np.log(3.0) + np.log1p(50.0 * START_VARIANCE), abs=1e-6)
    assert price == pytest.approx(2.0 * np.log(3.0) + float(inner_price(bend, ROWS)[0]), abs=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_play_whose_cycles_are_runs_of_their_own_is_the_play_of_the_joined_table(tmp_path: Path, seed: int) -> None:
    # Before each cycle, the stage returns to its first target, so that each run begins at the same end of the play.
    # Fifteen start states that were each fitted freely made an end stop or an offset beside the play more probable.
    rng = np.random.default_rng(seed)
    play_mm, noise_mm = 0.05, 0.0034
    inputs = np.tile([1.05, 6.33, 11.6, 16.88, 22.15], 15)
    gap = 2.0 + play(inputs, play_mm, 1.0) + noise_mm * rng.standard_normal(inputs.size)
    rows = [f"{k // 5},{45.6 * k:.1f},{u:.5f},{g:.5f}" for k, (u, g) in enumerate(zip(inputs, gap, strict=True))]
    report = diagnose(*written(tmp_path, "run,time_s,input_mm,gap_mm", rows, "-0.1,1.9\n23,25")).report
    assert set(report.alternatives) == {("backlash",), ("friction_hysteresis",)}
    assert [effect.name for effect in report.effects] == ["backlash"]
    size = report.effects[0].parameters["play_mm"]
    assert abs(size.value - play_mm) < 3.0 * size.u
    assert size.u < 0.1 * play_mm
