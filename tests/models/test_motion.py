"""Motion in time and over frequency, against independent integrations and solutions that share only the matrices."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ModelError, UsageError
from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import Physics
from fingervision.models.damping import Damping, ModalDamping, PaperDamping, RayleighDamping, parse_damping
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import LumpedGripper
from fingervision.models.modal_model import ModalModel, frequency_response, modal_motion, resolved_frequencies_hz
from fingervision.models.motion_in_time import gripper_motion
from fingervision.storage.mechanism_toml import read_mechanism

HALF_PERCENT, ONE_PERCENT = 0.005, 0.01
STAGE = Path(__file__).parents[2] / "fingervision" / "models" / "mechanisms" / "parallel_leaf_stage.toml"


def steps(*corners: tuple[float, float], rows: int = 400) -> DriveHistory:
    times, inputs = np.array(corners).T
    at = np.union1d(np.linspace(times[0], times[-1], rows), times)
    return DriveHistory(at, np.interp(at, times, inputs))


def integrated(model: ModalModel, ratios: np.ndarray, drive: DriveHistory, kinks: tuple[float, float]) -> np.ndarray:
    """Modal coordinates by scipy's DOP853, with kinks of the drive as jumps of speed."""
    kept = ratios.size
    w, participation = model.rad_s[:kept], model.participation[:kept]

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        q, v = state.reshape(2, -1)
        return np.concatenate([v, -2 * ratios * w * v - w**2 * q])

    speed = drive.input_mm[-1] / kinks[0]
    state, rows = np.zeros(2 * kept), []
    for (begin, end), jump in (((0.0, kinks[0]), speed), (kinks, -speed)):
        state[kept:] -= participation * jump
        inside = drive.time_s[(drive.time_s >= begin) & (drive.time_s <= end)]
        way = solve_ivp(slope, (begin, end), state, "DOP853", inside, rtol=1e-10, atol=1e-15)
        rows.append(way.y[:kept].T if not rows else way.y[:kept].T[1:])
        state = way.y[:, -1]
    return np.concatenate(rows)


@pytest.mark.parametrize(
    "damping", [ModalDamping(0.025), parse_damping("loss:0.1"), PaperDamping()], ids=["modal", "loss", "4"]
)
def test_step_response_against_an_adaptive_integration(lumped: LumpedGripper, damping: Damping) -> None:
    """A step of 0.5 mm within 2 ms, compared with scipy's DOP853 on the modes' equations, with kinks of the drive as
    jumps of speed.
    """
    model = lumped.modal_model(3)
    drive = steps((0.0, 0.0), (0.002, 0.5), (0.03, 0.5))
    found = modal_motion(model, drive, damping)
    expected = integrated(model, found.damping_ratios, drive, (0.002, 0.03))
    seen = model.observed["gap_mm"]
    expected = seen.rest_mm + seen.per_input * drive.input_mm + expected @ seen.by_mode[: found.modes_hz.size]
    vibration = np.ptp(expected - found.static_mm["gap_mm"])
    assert vibration > 0.1
    assert np.abs(found.observed_mm["gap_mm"] - expected).max() < HALF_PERCENT * vibration


@pytest.mark.parametrize("ratio", [0.005, 0.025, 0.1])
def test_logarithmic_decrement_is_the_damping_asked_for(lumped: LumpedGripper, ratio: float) -> None:
    """Ratio of successive peaks of the gap while a gripper vibrates freely after a sudden motion."""
    period = 1.0 / lumped.modes_hz(drive_held=True)[0] / np.sqrt(1 - ratio**2)
    peaks = 0.001 + 0.37 * period + np.arange(8) * period
    drive = DriveHistory(np.concatenate([[0.0, 0.001], peaks]), np.array([0.0, 0.1, *[0.1] * 8]))
    found = modal_motion(lumped.modal_model(1), drive, ModalDamping(ratio))
    ring = (found.observed_mm["gap_mm"] - found.static_mm["gap_mm"])[2:]
    decrement = np.log(ring[:-1] / ring[1:])
    assert decrement == pytest.approx(2 * np.pi * ratio / np.sqrt(1 - ratio**2), rel=ONE_PERCENT)


def test_force_of_a_sine_is_the_dynamic_stiffness(lumped: LumpedGripper) -> None:
    """Force over time against the full matrices at one frequency, with modal damping only."""
    frequency, system = 120.0, lumped.elastic.vibrating(8)
    time_s = np.arange(0.0, 0.5, 5e-5)
    drive = DriveHistory(time_s, 0.1 * np.sin(2 * np.pi * frequency * time_s))
    model = lumped.modal_model(8)
    found = modal_motion(model, drive, ModalDamping(0.02))
    w2, free = (2 * np.pi * frequency) ** 2, system.motions.toarray()
    dynamic = system.stiffness_n_mm.toarray() - w2 * system.mass_t.toarray()
    drawn = system.by_input
    moved = drawn - free @ np.linalg.solve(free.T @ dynamic @ free, free.T @ dynamic @ drawn)
    # The last quarter is steady; the inertia outside the modes acts on the drive at kinks only.
    steady = time_s > 0.375
    rest_t = model.mass_t - float(np.sum(model.participation**2))
    expected = float(drawn @ dynamic @ moved) + rest_t * w2
    turning = np.exp(-2j * np.pi * frequency * time_s[steady])
    amplitude = 2.0 * np.abs(np.mean(found.force_n[steady] * turning))
    assert amplitude == pytest.approx(0.1 * abs(expected), rel=0.02)


def test_frequency_response_against_the_full_matrices(lumped: LumpedGripper) -> None:
    """Compared with (K - w^2 M + i w C) u = f of the whole frame, with C from all modes, drive held and free."""
    ratio, tip = 0.025, lumped.gap_change_mm
    at = np.array([5.0, 45.0, 46.06, 47.0, 200.0, 340.0, 347.0, 354.0, 450.0])
    found = frequency_response(lumped.modal_model(12), lumped.free_modes(12), at, ModalDamping(ratio))
    system = lumped.elastic.vibrating(12)
    K, M, inside = system.stiffness_n_mm.toarray(), system.mass_t.toarray(), system.motions.toarray()
    every = np.column_stack([inside, system.by_input])

    def damping(count: int, *, held: bool) -> np.ndarray:
        rad_s, shapes, _ = system.modes(drive_held=held, count=count)
        return (M @ shapes * (2 * ratio * rad_s)) @ (M @ shapes).T

    static = system.unit_displacement
    held, free = damping(40, held=True), damping(40, held=False)
    for place, f in enumerate(at):
        w = 2 * np.pi * f
        # Damping acts on the motion relative to the static shape.
        dynamic = K - w**2 * M + 1j * w * held
        moved = static + inside @ np.linalg.solve(inside.T @ dynamic @ inside, w**2 * inside.T @ M @ static)
        gap = tip(moved.real) + 1j * tip(moved.imag)
        assert abs(found.per_input["gap_mm"][place] - gap) < HALF_PERCENT * abs(gap)
        push = np.append(np.zeros(inside.shape[1]), 1.0)
        answer = np.linalg.solve(every.T @ (K - w**2 * M + 1j * w * free) @ every, push)
        moved, drive = every @ answer, answer[-1]
        gap = tip(moved.real) + 1j * tip(moved.imag)
        assert abs(found.per_force_mm_n["gap_mm"][place] - gap) < HALF_PERCENT * abs(gap)
        assert abs(found.drive_per_force_mm_n[place] - drive) < HALF_PERCENT * abs(drive)


def test_half_power_width_is_the_damping_asked_for(lumped: LumpedGripper) -> None:
    model, free, law = lumped.modal_model(6), lumped.free_modes(6), ModalDamping(0.01)
    at = resolved_frequencies_hz(model, free, law, 40.0, 52.0)
    size = np.abs(frequency_response(model, free, at, law).per_force_mm_n["gap_mm"])
    wide = at[size > size.max() / np.sqrt(2.0)]
    fine = np.linspace(wide[0] - 0.5, wide[-1] + 0.5, 20001)
    size = np.abs(frequency_response(model, free, fine, law).per_force_mm_n["gap_mm"])
    wide = fine[size > size.max() / np.sqrt(2.0)]
    assert np.ptp(wide) / (2.0 * fine[size.argmax()]) == pytest.approx(0.01, rel=ONE_PERCENT)


def test_equation_4_describes_the_lowest_modes_alone(lumped: LumpedGripper) -> None:
    found = modal_motion(lumped.modal_model(8), steps((0.0, 0.0), (0.01, 0.1)), PaperDamping())
    # zeta(1) = 0.045 gamma by the dimensionless equation, with gamma = 0.5; the ratio of the second mode would be 0.45.
    assert found.damping_ratios == pytest.approx([0.0225], rel=0.01)
    assert found.modes_hz.size == 1


def test_time_steps_and_modes_agree(gripper: Gripper) -> None:
    """Without contact during the motion, modes and time steps describe the same linear body."""
    drive = steps((0.0, 0.0), (0.005, 0.2), (0.01, 0.2), rows=100)
    modal = gripper_motion(LumpedGripper(gripper), drive)
    stepped = gripper_motion(LumpedGripper(gripper, Physics(contact=True)), drive)
    assert "steps" in stepped.method
    travel = np.ptp(modal.gap_mm)
    assert np.abs(stepped.gap_mm - modal.gap_mm).max() < HALF_PERCENT * travel


def test_a_slow_drive_passes_through_the_equilibria(gripper: Gripper) -> None:
    model = LumpedGripper(gripper, Physics(large_rotation=True, contact=True))
    drive = steps((0.0, 0.0), (30.0, 1.8), (60.0, -0.7), rows=100)
    found = gripper_motion(model, drive)
    answer = model.respond(drive.input_mm)
    assert "equilibria" in found.method
    assert found.gap_mm == pytest.approx(answer.gap_mm, abs=1e-3)
    assert found.motion.force_n == pytest.approx(answer.force_n, abs=0.02)
    assert found.gap_mm.min() > -1e-3


def test_a_drive_too_long_and_too_fast_for_large_rotation_is_refused(gripper: Gripper) -> None:
    model = LumpedGripper(gripper, Physics(large_rotation=True))
    time_s = np.linspace(0.0, 4.0, 4001)
    drive = DriveHistory(time_s, 0.2 * np.sin(2 * np.pi * 300.0 * time_s))
    with pytest.raises(ModelError, match=r"must be shorter than .* the drive takes 4 s and the gap vibrates by"):
        gripper_motion(model, drive)


def test_runs_begin_at_rest_each(lumped: LumpedGripper) -> None:
    one = steps((0.0, 0.0), (0.004, 0.3), (0.01, 0.3))
    twice = DriveHistory(
        np.concatenate([one.time_s, one.time_s + 0.02]),
        np.concatenate([one.input_mm] * 2),
        tuple(["a"] * one.time_s.size + ["b"] * one.time_s.size),
    )
    found = gripper_motion(lumped, twice).gap_mm
    assert found[: one.time_s.size] == pytest.approx(found[one.time_s.size :], abs=1e-9)
    assert found[: one.time_s.size] == pytest.approx(gripper_motion(lumped, one).gap_mm, abs=1e-12)


def test_heavier_material_vibrates_slower(gripper: Gripper) -> None:
    heavy = replace(gripper, material=replace(gripper.material, density_kg_m3=4 * 930.0))
    modes = [LumpedGripper(g).modal_model(2).modes_hz for g in (gripper, heavy)]
    assert modes[0] == pytest.approx(2.0 * modes[1], rel=1e-9)


@pytest.mark.slow
def test_stage_on_two_leaves_vibrates_as_mass_and_spring() -> None:
    """Response to a force: 1 / (k - m w^2) below the first mode, with the mass from the mode and the stiffness from
    statics.
    """
    plate = MechanismPlate(read_mechanism(STAGE))
    frequency = 2 * np.pi * plate.modes_hz(drive_held=False, count=1)[0]
    at = np.linspace(0.1, 0.9, 5) * frequency / (2 * np.pi)
    found = frequency_response(plate.modal_model(4), plate.free_modes(4), at, ModalDamping(1e-6))
    expected = 1.0 / (plate.stiffness_n_mm * (1.0 - (2 * np.pi * at / frequency) ** 2))
    assert found.drive_per_force_mm_n.real == pytest.approx(expected, rel=ONE_PERCENT)
    assert found.per_force_mm_n["stage_x_mm"].real == pytest.approx(expected, rel=2 * ONE_PERCENT)


@pytest.mark.parametrize(
    "text",
    ["", "modal", "modal:0", "modal:-0.1", "modal:0.5", "modal:nan", "loss:0.6", "rayleigh:0.02", "rayleigh:0.02:50:40",
     "paper:x", "viscous:0.1", "modal:0.02:3"],
)  # fmt: skip
def test_no_damping_law(text: str) -> None:
    with pytest.raises(UsageError, match=r"--damping .*must"):
        parse_damping(text)


def test_damping_laws_by_their_text() -> None:
    rad_s = 2 * np.pi * np.array([45.0, 360.0])
    assert parse_damping("loss:0.05").ratios(rad_s) == pytest.approx(0.025)
    assert parse_damping("rayleigh:0.03:45:360").ratios(rad_s) == pytest.approx(0.03)
    assert isinstance(parse_damping("rayleigh:0.03:45:360"), RayleighDamping)
    assert parse_damping("paper:0.4").ratios(rad_s[:1]) == pytest.approx(0.4 * 0.045, rel=0.01)
