import numpy as np
import pytest
from scipy.sparse import csr_matrix

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import Physics
from fingervision.models.damping import Damping, ModalDamping, PaperDamping, RayleighDamping, paper_rate, parse_damping
from fingervision.models.generalized_alpha import integrate
from fingervision.models.lumped import LumpedGripper
from fingervision.models.modal_model import modal_motion
from fingervision.models.mode_shapes import ModesWanted, mode_shapes
from fingervision.models.motion_in_time import ReducedMotion
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper

# Damping ratio of equation (4) by dimensionless frequency, printed with two or three digits.
PAPER_RATIOS = {1.0: 0.045, 2.0: 0.376, 5.0: 1.13, 10.0: 2.0, 100.0: 7.7, 1e3: 24.8, 6e3: 61.0, 1e5: 248.0}


@pytest.mark.parametrize("w", PAPER_RATIOS)
def test_equation_4_by_mode(w: float) -> None:
    assert paper_rate(w) / (2.0 * w) == pytest.approx(PAPER_RATIOS[w], rel=0.02)


def test_equation_4_damps_negatively_below_one() -> None:
    assert paper_rate(0.5) == pytest.approx(-19.5, rel=0.01)
    with pytest.raises(ModelError, match="is negative below its reference frequency, 300 rad/s, but the"):
        PaperDamping(300.0).ratios(np.array([280.0, 2000.0]))


def test_overdamped_modes_are_refused() -> None:
    with pytest.raises(ModelError, match=r"must lie between 0 and 0\.3, but one is"):
        PaperDamping(280.0, 1.0).ratios(np.array([280.0, 28000.0]))
    assert PaperDamping(280.0, 0.5).ratios(np.array([280.0])) == pytest.approx(0.0225, rel=0.02)


def test_rayleigh_and_loss_factor() -> None:
    low, high = 2 * np.pi * 45.0, 2 * np.pi * 360.0
    rayleigh = RayleighDamping(0.025, low, high)
    assert rayleigh.ratios(np.array([low, high])) == pytest.approx([0.025, 0.025])
    assert rayleigh.mass_factor_per_s == pytest.approx(12.6, abs=0.05)
    assert rayleigh.stiffness_factor_s == pytest.approx(1.96e-5, rel=0.005)
    assert parse_damping("loss:0.06").ratios(np.array([1.0])) == pytest.approx(0.03)


def modal_gap_mm(
    model: LumpedGripper, drive: DriveHistory, damping: Damping | None = None, modes: int = 3
) -> np.ndarray:
    return np.asarray(modal_motion(model.modal_model(modes), drive, damping).observed_mm["gap_mm"])


def oscillator(steps: int, radius: float = 0.8, ratio: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """One period of a unit mass on a unit spring, released from a displacement of 1."""
    one = csr_matrix(np.eye(1))
    step_s = 2.0 * np.pi / steps
    motion = integrate(
        one,
        2.0 * ratio * one,
        lambda u: (one, u),
        (np.ones(1), np.zeros(1)),
        (np.array([], dtype=np.int64), np.zeros(steps + 1)),
        np.array([0]),
        step_s,
        high_frequency_radius=radius,
    )
    return motion.displacement[:, 0], motion.velocity[:, 0]


def test_generalised_alpha_is_of_second_order() -> None:
    errors = [abs(oscillator(steps)[0][-1] - 1.0) + abs(oscillator(steps)[1][-1]) for steps in (50, 100, 200)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0, 2.0], abs=0.1)


def test_energy_dies_away_and_never_grows() -> None:
    u, v = oscillator(100, ratio=0.025)
    energy = 0.5 * (u**2 + v**2)
    assert np.all(np.diff(energy) < 1e-12)
    assert energy[-1] / energy[0] == pytest.approx(np.exp(-4.0 * np.pi * 0.025), rel=0.01)


def test_stepped_frame_and_modes_vibrate_alike(gripper: Gripper) -> None:
    """A ramp of 4 ms, then free vibration with held drive: modes against time steps in the deformed shape."""
    bars = StiffnessMatrixGripper(gripper)
    frame = bars.elastic.driven
    step_s, rise_s = 5e-5, 4e-3
    time_s = np.arange(241) * step_s
    history = 0.01 * np.minimum(time_s / rise_s, 1.0)
    drive = DriveHistory(time_s, history)
    modal = modal_gap_mm(bars, drive, ModalDamping(1e-6), modes=8)
    motion = integrate(
        frame.mass_t,
        csr_matrix(frame.mass_t.shape),
        frame.tangent,
        (np.zeros(frame.unknowns), np.zeros(frame.unknowns)),
        (np.flatnonzero(frame.by_input), history),
        np.flatnonzero(np.diff(frame.motions.indptr)),
        step_s,
        high_frequency_radius=0.5,
    )
    stepped = np.array([4.0 + bars.gap_change_mm(row) for row in motion.displacement])
    # The kinks excite modes beyond the eighth and beyond the step; they are small.
    assert np.abs(stepped - modal).max() < 0.05 * np.abs(modal - 4.0).max()


def test_slow_drive_is_answered_statically(lumped: LumpedGripper) -> None:
    time_s = np.linspace(0.0, 60.0, 1501)
    inputs = np.interp(time_s, [0.0, 20.0, 40.0, 60.0], [0.0, 1.5, -0.4, 1.0])
    gap = modal_gap_mm(lumped, DriveHistory(time_s, inputs))
    assert gap == pytest.approx(lumped.respond(inputs).gap_mm, abs=1e-3)


def test_struck_gripper_rings_down_at_its_damping(lumped: LumpedGripper) -> None:
    frequency = lumped.modes_hz(drive_held=True)[0]
    time_s = np.concatenate([[0.0, 1e-3], 1e-3 + np.arange(1, 41) / frequency / np.sqrt(1 - 0.025**2)])
    inputs = np.minimum(time_s / 1e-3, 1.0) * 0.1
    ring = modal_gap_mm(lumped, DriveHistory(time_s, inputs), ModalDamping(0.025), modes=1)[2:] - 4.0
    ring -= lumped.respond(np.array([0.1])).gap_mm[0] - 4.0
    assert np.log(ring[:-1] / ring[1:]) == pytest.approx(2 * np.pi * 0.025 / np.sqrt(1 - 0.025**2), rel=1e-3)


@pytest.mark.slow
def test_fingers_driven_together_do_not_pass_through(gripper: Gripper) -> None:
    time_s = np.linspace(0.0, 0.06, 121)
    drive = DriveHistory(time_s, np.interp(time_s, [0.0, 0.02, 0.06], [0.0, -0.57, -0.57]))
    law = ModalDamping(0.1)
    (gap, force), (through, _) = (
        ReducedMotion(LumpedGripper(gripper, Physics(large_rotation=True, contact=contact))).over(drive, law, 1e-4)
        for contact in (True, False)
    )
    # With a penalty of 20 times the finger's stiffness of 2.6 N/mm, each finger penetrates by its grip divided by 52
    # N/mm.
    assert gap.min() > -0.03
    assert force[-1] < -2.0
    assert through[-1] == pytest.approx(4.0 - 0.57 * 7.73, abs=0.05)


def test_a_film_s_mirrored_halves_meet_and_do_not_pass_through_each_other(lumped: LumpedGripper) -> None:
    shapes = mode_shapes(lumped.elastic, ModesWanted(2))
    for shape in shapes:
        right = np.arange(len(shape.lines_mm) // 2)
        closed = (shape.lines_mm - shape.swing * shape.shift_mm)[right, :, 0]
        assert shape.family.startswith("swaying") or closed.min() > -1e-6
    assert any(shape.swing < 1.0 for shape in shapes)
