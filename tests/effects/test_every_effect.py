"""Every effect passes the contract tests; further tests of play, map, slew limit, creep and resonance."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.domain.effect import curve_values, start_key
from fingervision.effects import catalogue
from fingervision.testing import EffectContract, NotApplicable, checks_of
from fingervision.testing.effect_contract import MODEL, bench

ROUNDING_MM = 1e-9
"""Tolerance for rounding errors of a few operations on numbers of some millimetres."""
# Names in the order of the catalogue, on which other programs rely. New effects are inserted or appended.
PUBLISHED = [
    "drive_lag", "input_offset", "input_scale", "encoder_cyclic_error", "end_stop", "position_error_map", "slew_limit",
    "backlash", "stick_slip", "friction_hysteresis", "lever_ratio_error", "large_deflection", "viscoelastic_creep",
    "structural_resonance", "rest_gap_error", "assembly_asymmetry", "finger_contact", "thermal_drift",
    "hinge_stiffness_error", "camera_drift", "camera_scale_drift", "out_of_plane_motion", "scale_error",
    "lens_distortion", "camera_tilt", "edge_bias", "camera_latency",
]  # fmt: skip


def test_the_published_effects_are_there_and_in_their_order() -> None:
    assert [name for name in catalogue() if name in PUBLISHED] == PUBLISHED
    stages = [effect.stage for effect in catalogue().values()]
    assert sorted(stages, key=["drive", "mechanism", "camera"].index) == stages


@pytest.mark.parametrize("check", checks_of(EffectContract))
@pytest.mark.parametrize("name", list(catalogue()))
def test_every_effect_keeps_the_contract(name: str, check: str) -> None:
    contract = EffectContract()
    contract.effect = catalogue()[name]
    with suppress(NotApplicable):
        getattr(contract, check)()


CURVED = [name for name, effect in catalogue().items() if getattr(effect, "act_curved", None) is not None]


@pytest.mark.parametrize("name", CURVED)
def test_along_curves_an_effect_is_the_same_where_the_record_is_straight_and_keeps_its_corners(name: str) -> None:
    setting = {name: {"delay_s": 0.05}}
    straight = MeasuringChain(MODEL, bench(), {}).respond(setting).gap_mm
    curved = MeasuringChain(MODEL, bench(), {}, curved=True).respond(setting).gap_mm
    up = slice(4, 118)
    np.testing.assert_allclose(curved[up], straight[up], atol=ROUNDING_MM)
    # At a corner, Akima's curve overshoots by less than a tenth of the step between two samples.
    assert curved.max() <= straight.max() + 0.1 * float(np.max(np.diff(straight)))
    assert curved[0] == pytest.approx(straight[0], abs=ROUNDING_MM)


@pytest.mark.parametrize("start", [-1.0, -0.3, 1.0])
def test_a_play_starts_anywhere_within_its_width_and_forgets_it_at_the_first_reversal(start: float) -> None:
    chain, history = MeasuringChain(MODEL, bench(), {}), bench()
    play = {"play_mm": 0.04, start_key(0): start, start_key(1): start}
    gap = chain.respond({"backlash": play}).gap_mm
    bare, centred = chain.respond({}).gap_mm, chain.respond({"backlash": {"play_mm": 0.04}}).gap_mm
    for run in history.runs:
        assert gap[run][0] - bare[run][0] == pytest.approx(7.7 * 0.02 * start, abs=ROUNDING_MM)
        np.testing.assert_allclose(gap[run][10:], centred[run][10:], atol=ROUNDING_MM)


def test_a_rate_limit_is_caught_up_at_its_speed_after_a_step() -> None:
    time = np.arange(0.0, 2.0, 0.02)
    u = np.where(time > 0.5, 1.0, 0.0)
    history = replace(bench(), input_mm=u, time_s=time, runs=(slice(0, u.size),))
    gap = MeasuringChain(MODEL, history, {}).respond({"slew_limit": {"speed_mm_s": 2.0}}).gap_mm
    expected = np.clip(2.0 * (time - 0.5), 0.0, 1.0)
    np.testing.assert_allclose(gap, 4.0 + 7.7 * expected, atol=7.7 * 2.0 * 0.02)
    assert np.flatnonzero(gap > 11.7 - 1e-9)[0] == pytest.approx(np.flatnonzero(time >= 1.0)[0], abs=1)


def test_a_map_adds_the_same_error_both_ways_and_holds_its_points() -> None:
    at, errors = np.linspace(-0.5, 1.5, 9), 0.01 * np.cos(np.arange(9.0))
    setting = {"rms_mm": 0.007, "length_mm": 0.3, **curve_values(at.tolist(), errors.tolist())}
    chain = MeasuringChain(MODEL, bench(), {})
    change = chain.respond({"position_error_map": setting}).gap_mm - chain.respond({}).gap_mm
    np.testing.assert_allclose(change[:120], change[160:280][::-1], atol=ROUNDING_MM)
    history = replace(bench(), input_mm=at, time_s=np.arange(9.0), runs=(slice(0, 9),))
    there = MeasuringChain(MODEL, history, {})
    moved = there.respond({"position_error_map": setting}).gap_mm - there.respond({}).gap_mm
    np.testing.assert_allclose(moved, 7.7 * errors, atol=ROUNDING_MM)


def test_play_is_its_full_width_between_the_branches() -> None:
    chain = MeasuringChain(MODEL, bench(), {})
    gap = chain.respond({"backlash": {"play_mm": 0.04}}).gap_mm
    bare = chain.respond({}).gap_mm
    assert gap[100] - bare[100] == pytest.approx(-0.02 * 7.7, abs=ROUNDING_MM)
    assert gap[200] - bare[200] == pytest.approx(0.02 * 7.7, abs=ROUNDING_MM)


def test_creep_reaches_the_simulation_under_a_held_input() -> None:
    time = np.arange(0.0, 40.0, 0.04)
    u = np.where(time > 0.02, 1.0, 0.0)
    history = replace(bench(), input_mm=u, time_s=time, runs=(slice(0, u.size),))
    settings = {"fraction_1s": 0.2, "fraction_4s": 0.0, "fraction_16s": 0.0, "fraction_64s": 0.0}
    gap = MeasuringChain(MODEL, history, {}).respond({"viscoelastic_creep": settings}).gap_mm
    # The step is a ramp over one sample, so that its low-pass response lags by half a sample.
    expected = 11.7 - 0.2 * 7.7 * np.exp(-(time[1:] - 0.02) / 1.0)
    np.testing.assert_allclose(gap[1:], expected, atol=1e-3)


def test_resonance_rings_at_its_frequency_and_dies_with_its_damping() -> None:
    time = np.arange(0.0, 4.0, 0.01)
    u = np.where(time > 0.005, 1.0, 0.0)
    history = replace(bench(), input_mm=u, time_s=time, runs=(slice(0, u.size),))
    gap = (
        MeasuringChain(MODEL, history, {})
        .respond({"structural_resonance": {"frequency_hz": 2.0, "damping_ratio": 0.05}})
        .gap_mm
    )
    peaks = [i for i in range(1, gap.size - 1) if gap[i - 1] < gap[i] > gap[i + 1]]
    assert np.mean(np.diff(time[peaks])) == pytest.approx(0.5 / np.sqrt(1.0 - 0.05**2), abs=0.01)
    over = gap[peaks] - 11.7
    assert over[1] / over[0] == pytest.approx(np.exp(-2.0 * np.pi * 0.05 / np.sqrt(1.0 - 0.05**2)), rel=0.01)
