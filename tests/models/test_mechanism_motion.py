"""Mechanisms in motion, against adaptive integration and full matrices, and between kinds of model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

from fingervision.cli.model import command
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import FingervisionError
from fingervision.models.damping import Damping, LossFactor, ModalDamping, PaperDamping, RayleighDamping
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.modal_model import ModalModel, frequency_response, modal_motion
from fingervision.storage.mechanism_toml import read_mechanism

HALF_PERCENT, ONE_PERCENT = 0.005, 0.01
DRAWN = Path(__file__).parents[2] / "fingervision" / "models" / "mechanisms"


@pytest.fixture(scope="module")
def bridge() -> MechanismFrame:
    return MechanismFrame(read_mechanism(DRAWN / "bridge_amplifier.toml"))


@pytest.fixture(scope="module")
def arms() -> MechanismFrame:
    return MechanismFrame(read_mechanism(DRAWN / "two_driven_arms.toml"))


def struck(model: ModalModel, size_mm: float) -> tuple[DriveHistory, tuple[float, float]]:
    """A ramp of a third of the first period, then rest over eight periods, and the times of its kinks (s)."""
    period_s = 1.0 / float(model.modes_hz[0])
    kinks = 0.3 * period_s, 8.0 * period_s
    at = np.union1d(np.linspace(0.0, kinks[1], 500), kinks)
    return DriveHistory(at, np.interp(at, [0.0, kinks[0]], [0.0, size_mm])), kinks


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
    "damping", [ModalDamping(0.025), LossFactor(0.1), RayleighDamping(0.02, 1e4, 1e5), PaperDamping()],
    ids=["modal", "loss", "rayleigh", "4"],
)  # fmt: skip
def test_lumped_motion_against_an_adaptive_integration(bridge: MechanismFrame, damping: Damping) -> None:
    model = bridge.modal_model(4)
    drive, kinks = struck(model, 0.05)
    found = modal_motion(model, drive, damping)
    expected = integrated(model, found.damping_ratios, drive, kinks)
    for name, seen in model.observed.items():
        by_mode = seen.by_mode[: found.damping_ratios.size]
        exact = seen.rest_mm + seen.per_input * drive.input_mm + expected @ by_mode
        vibration = np.ptp(exact - found.static_mm[name])
        assert vibration > 0.0
        assert np.abs(found.observed_mm[name] - exact).max() < HALF_PERCENT * vibration


def test_lumped_frequency_response_against_the_full_matrices(arms: MechanismFrame) -> None:
    """Compared with (K - w^2 M) u = f for all frames and own modes, nearly undamped, with drives held and free."""
    system = arms.vibrating(10)
    K, M, free, by = (
        system.stiffness_n_mm.toarray(),
        system.mass_t.toarray(),
        system.motions.toarray(),
        system.by_input,
    )
    model, loose = arms.modal_model(10), arms.free_modes(10)
    at = np.array([0.3, 0.9]) * model.modes_hz[0]
    found = frequency_response(model, loose, at, ModalDamping(1e-6))
    observed = arms.probes_by(np.eye(by.size))
    for place, frequency in enumerate(at):
        dynamic = K - (2 * np.pi * frequency) ** 2 * M
        moved = by - free @ np.linalg.solve(free.T @ dynamic @ free, free.T @ dynamic @ by)
        assert found.per_input["tip_x_mm"][place].real == pytest.approx(observed["tip"][0] @ moved, rel=HALF_PERCENT)
        # With free drives, the force acts on the drives, which move in their ratio.
        force = by @ dynamic @ moved
        assert found.drive_per_force_mm_n[place].real == pytest.approx(1.0 / force, rel=HALF_PERCENT)


def test_two_drives_in_motion_are_the_sum_of_each_alone(arms: MechanismFrame) -> None:
    motions = []
    for ratios in ((1.0, 0.0), (0.0, 1.0), (1.0, -0.5)):
        drives = (replace(d, per_input=r) for d, r in zip(arms.mechanism.drives, ratios, strict=True))
        model = MechanismFrame(replace(arms.mechanism, drives=tuple(drives))).modal_model(6)
        drive, _ = struck(model, 0.1)
        motions.append(modal_motion(model, drive, ModalDamping(0.02)))
    lower, upper, both = motions
    for name, seen in both.observed_mm.items():
        expected = lower.observed_mm[name] - 0.5 * upper.observed_mm[name]
        assert np.abs(seen - expected).max() < 1e-6 * np.ptp(expected)


@pytest.mark.slow
def test_lumped_motion_is_that_of_finite_elements() -> None:
    """Modes agree within 1 %; the vibration after a sudden motion of the drive, at the same phase of the first mode,
    within 3 %.
    """
    mechanism = read_mechanism(DRAWN / "four_bar_gripper.toml")
    answers = []
    for kind in (MechanismPlate, MechanismFrame):
        model = kind(mechanism).modal_model(4)
        drive, _ = struck(model, 0.1)
        answers.append((model, modal_motion(model, drive, ModalDamping(0.02))))
    (plate, meshed), (frame, lumped) = answers
    assert frame.modes_hz[:2] == pytest.approx(plate.modes_hz[:2], rel=ONE_PERCENT)
    assert np.abs(frame.participation[:2]) == pytest.approx(np.abs(plate.participation[:2]), rel=0.03)
    for column, seen in meshed.observed_mm.items():
        whole = seen - meshed.static_mm[column]
        ours = lumped.observed_mm[column] - lumped.static_mm[column]
        biggest = max(np.abs(seen - meshed.static_mm[c]).max() for c, seen in meshed.observed_mm.items())
        assert np.abs(ours - whole).max() < 0.03 * biggest


@pytest.mark.slow
def test_the_command_moves_both_kinds(tmp_path: Path) -> None:
    drive = tmp_path / "drive.csv"
    drive.write_text("time_s,input_mm\n0,0\n0.01,0.2\n0.05,0.2\n")
    arguments = [str(DRAWN / "four_bar_gripper.toml"), "--drive", str(drive), "--rate-hz", "2000", "--modes", "2",
                 "--frequency", "10:300", "--damping", "paper", "--out", str(tmp_path / "o")]  # fmt: skip
    said = CliRunner().invoke(command, arguments, catch_exceptions=False).output
    assert "finite_element in time by" in said
    assert "lumped in time by" in said
    headers = [(tmp_path / "o" / part / "response.csv").read_text().splitlines()[0] for part in (".", "lumped")]
    assert headers[0] == headers[1]
    assert headers[0].startswith("time_s,input_mm,")
    for name in ("modes.csv", "frequency.csv"):
        kinds = {line.split(",")[0] for line in (tmp_path / "o" / name).read_text().splitlines()[1:]}
        assert kinds == {"finite_element", "lumped"}


@pytest.mark.slow
def test_a_drive_that_shakes_a_bent_mechanism_too_much_is_refused(tmp_path: Path) -> None:
    drive = tmp_path / "drive.csv"
    drive.write_text("time_s,input_mm\n0,0\n0.0005,0.5\n0.05,0.5\n")
    arguments = [str(DRAWN / "four_bar_gripper.toml"), "--kind", "lumped", "--drive", str(drive), "--rate-hz", "20000",
                 "--large-rotation", "--out", str(tmp_path / "o")]  # fmt: skip
    with pytest.raises(FingervisionError, match=r"must make .* vibrate by at most 0.05 of its travel of"):
        CliRunner().invoke(command, arguments, catch_exceptions=False)
