"""Mechanisms in motion, against adaptive integration and full matrices, and between kinds of model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import FingervisionError
from fingervision.models.damping import ModalDamping
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.modal_model import ModalModel, modal_motion
from fingervision.storage.mechanism_toml import read_mechanism

HALF_PERCENT, ONE_PERCENT = 0.005, 0.01
DRAWN = Path(__file__).parents[2] / "fingervision" / "models" / "mechanisms"


@pytest.fixture(scope="module")
def arms() -> MechanismFrame:
    return MechanismFrame(read_mechanism(DRAWN / "two_driven_arms.toml"))


def struck(model: ModalModel, size_mm: float) -> tuple[DriveHistory, tuple[float, float]]:
    """A ramp of a third of the first period, then rest over eight periods, and the times of its kinks (s)."""
    period_s = 1.0 / float(model.modes_hz[0])
    kinks = 0.3 * period_s, 8.0 * period_s
    at = np.union1d(np.linspace(0.0, kinks[1], 500), kinks)
    return DriveHistory(at, np.interp(at, [0.0, kinks[0]], [0.0, size_mm])), kinks


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
