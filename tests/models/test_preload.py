"""Preload of a drive, against the beam-column of exact theory and the same mechanism moved by its drive."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import ModelError
from fingervision.models.elastic_mechanism import ElasticMechanism
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import mechanism_figures, response_figures
from fingervision.models.rigid_bodies import RigidBodies
from tests.drawings import drawing
from tests.models.coarse import coarse_elements

HEAD = """
plate_mm = 4.0
material = { name = "m", youngs_modulus_mpa = 70000, poisson_ratio = 0.0, density_kg_m3 = 2700, yield_mpa = 300 }
"""
COLUMN = """
[[body]]
name = "foot"
box_mm = [-5, 5, -6, 0]
[[body]]
name = "head"
box_mm = [-8, 8, 40, 56]
[[flexure]]
name = "leaf"
kind = "leaf"
at_mm = [0, 20]
axis_deg = 90
thickness_mm = 0.5
half_length_mm = 21
[[fixed]]
box_mm = [-5, 5, -6, -6]
"""
SIDE = """
[[drive]]
name = "side"
box_mm = [8, 8, 41, 55]
direction = [1, 0]
across = "free"
turns = "held"
"""
WEIGHT = """
[[drive]]
name = "weight"
box_mm = [-7, 7, 56, 56]
direction = [0, -1]
across = "free"
turns = "free"
per_input = 0
force_n_per_input = 1
"""
STAGE = """
[[body]]
name = "ground"
box_mm = [0, 40, 0, 6]
[[body]]
name = "table"
box_mm = [0, 40, 26, 32]
[[flexure]]
name = "left"
kind = "leaf"
at_mm = [3, 16]
axis_deg = 90
thickness_mm = 0.5
half_length_mm = 11
[[flexure]]
name = "right"
kind = "leaf"
at_mm = [37, 16]
axis_deg = 90
thickness_mm = 0.5
half_length_mm = 11
[[fixed]]
box_mm = [0, 40, 0, 0]
[[probe]]
name = "end"
at_mm = [40, 29]
[[probe]]
name = "ground"
at_mm = [40, 3]
[[pair]]
name = "gap"
of = ["ground", "end"]
[drive]
box_mm = [0, 0, 27, 31]
direction = [1, 0]
across = "free"
"""
RIGIDITY_N_MM2 = 70000.0 * 4.0 * 0.5**3 / 12.0


Kind = Callable[[Mechanism], ElasticMechanism]
elements = partial(coarse_elements, refine=0.3)


def drawn(folder: Path, text: str) -> Mechanism:
    return drawing(folder, HEAD + text)


def column(folder: Path, preload_n: float) -> Mechanism:
    return drawn(folder, COLUMN + SIDE + WEIGHT + f"preload_n = {preload_n}\n")


@pytest.mark.parametrize("kind", [elements, MechanismFrame], ids=["elements", "frame"])
def test_a_leaf_under_a_weight_is_the_beam_column(tmp_path: Path, kind: Kind) -> None:
    """Stiffness across a guided column: P / (L (tan x / x - 1)) with x = L sqrt(P / EI) / 2, and 0 at Euler's load.

    Source: Timoshenko and Gere, Theory of Elastic Stability, sections 1.3 and 2.1. The root of the frequency of a head
    on the column is the root of its stiffness, 1 - P / Pcr nearly.
    """
    bare = kind(column(tmp_path, 0.0))
    length = (12.0 * RIGIDITY_N_MM2 / bare.stiffness_n_mm) ** (1.0 / 3.0)  # with the compliance of the roots
    assert length == pytest.approx(40.0, rel=0.012)
    critical_n = np.pi**2 * RIGIDITY_N_MM2 / length**2
    for share in (0.1, 0.5, 0.8, -1.0):
        model = kind(column(tmp_path, share * critical_n))
        x = 0.5 * length * np.emath.sqrt(share * critical_n / RIGIDITY_N_MM2)
        exact = float(np.real(share * critical_n / (length * (np.tan(x) / x - 1.0))))
        assert model.stiffness_n_mm == pytest.approx(exact, rel=0.01)
        assert abs(model.stiffness_n_mm / exact - 1.0) < model.force_error
        falls = model.modes_hz(drive_held=False)[0] / bare.modes_hz(drive_held=False)[0]
        assert falls == pytest.approx(np.sqrt(1.0 - share), rel=0.01 if share > 0.0 else 0.03)
        assert falls == pytest.approx(np.sqrt(model.stiffness_n_mm / bare.stiffness_n_mm), rel=0.002)


@pytest.mark.parametrize("kind", [partial(elements, refine=0.5), MechanismFrame], ids=["elements", "frame"])
def test_a_preload_states_its_force_sag_and_stress(tmp_path: Path, kind: Kind) -> None:
    """A weight on a straight leaf shortens it by P L / (E A), and the bodies a little, at a stress of P / A.

    Half a thickness beside its sharp roots, the stress of a coarse mesh is 3 % more.
    """
    figures = response_figures(kind(column(tmp_path, 9.0)))
    assert figures["weight: preload [N]"] == pytest.approx(9.0)
    assert figures["side: preload [N]"] == 0.0
    assert figures["weight: moved by the preload [mm]"] == pytest.approx(9.0 * 40.0 / (70000.0 * 2.0), rel=0.08)
    assert figures["preload_stress_mpa"] == pytest.approx(9.0 / 2.0, rel=0.04)
    assert not any("preload" in name for name in response_figures(kind(column(tmp_path, 0.0))))


@pytest.mark.parametrize("kind", [elements, MechanismFrame], ids=["elements", "frame"])
@pytest.mark.parametrize("actuator", ["", "stiffness_n_mm = 3.0\n", "force_n_per_input = 0.5\n"])
def test_a_stage_pressed_along_its_motion_is_the_stage_there(tmp_path: Path, kind: Kind, actuator: str) -> None:
    """The preload moves the stage as its drive would; from there on, only the large rotation there is new."""
    bare, pressed = (kind(drawn(tmp_path, STAGE + actuator + f"preload_n = {force}\n")) for force in (0.0, 0.8))
    system, rest = pressed.driven, pressed.state(0.0)
    stage = kind(drawn(tmp_path, STAGE))
    there = stage.state(float(system.rest_faces_mm[0]), large_rotation=True)
    assert there.force_n == pytest.approx(0.8, rel=1e-6)
    assert rest.probes_mm["end"] == pytest.approx(there.probes_mm["end"], abs=1e-7)
    assert rest.force_n == pytest.approx(0.8)
    assert rest.stress_mpa == pytest.approx(there.stress_mpa, rel=0.02)
    one, moved = pressed.state(1e-3), bare.state(1e-3)
    assert one.force_n - rest.force_n == pytest.approx(moved.force_n, rel=0.02)
    bent = pressed.state(1e-3, large_rotation=True)
    assert bent.probes_mm["end"][0] == pytest.approx(one.probes_mm["end"][0], rel=1e-5)
    figures, without = response_figures(pressed), response_figures(bare)
    assert figures["end: x per input [mm/mm]"] == pytest.approx(without["end: x per input [mm/mm]"], rel=0.02)
    assert figures["gap: at rest [mm]"] == pytest.approx(rest.pairs_mm["gap"])
    left_mpa = 300.0 - figures["preload_stress_mpa"]
    at_yield_mm = left_mpa / without["peak_stress_mpa_per_mm"]
    assert figures["input_at_yield_mm"] == pytest.approx(at_yield_mm, rel=0.05)
    assert pressed.state(figures["input_at_yield_mm"]).stress_mpa == pytest.approx(300.0, rel=1e-6)
    vibrating = pressed.modal_model(2)
    assert vibrating.rest_force_n == pytest.approx(0.8)
    assert vibrating.observed["end_x_mm"].rest_mm == pytest.approx(rest.probes_mm["end"][0])


@pytest.mark.parametrize("kind", [elements, MechanismFrame], ids=["elements", "frame"])
def test_a_leaf_that_a_preload_bends_far_is_not_stretched(tmp_path: Path, kind: Kind) -> None:
    """A guided leaf carries M = P L / 2 at its ends. It comes nearer as it bends, which costs no axial strain.

    Small strains of the displacement at rest would count that as 0.6 (d / L)^2 E, here 88 MPa of 120 MPa.
    """
    bending_mpa = 6.0 * (1.0 * 40.0 / 2.0) / (4.0 * 0.5**2)
    straight = response_figures(kind(drawn(tmp_path, COLUMN + SIDE)))
    bent = response_figures(kind(drawn(tmp_path, COLUMN + SIDE + "preload_n = 1.0\n")))
    assert bent["preload_stress_mpa"] == pytest.approx(bending_mpa, rel=0.05)
    assert bent["peak_stress_mpa_per_mm"] == pytest.approx(straight["peak_stress_mpa_per_mm"], rel=0.02)
    left_mm = (300.0 - bent["preload_stress_mpa"]) / bent["peak_stress_mpa_per_mm"]
    assert bent["input_at_yield_mm"] == pytest.approx(left_mm, rel=0.01)


@pytest.mark.parametrize("kind", [elements, MechanismFrame], ids=["elements", "frame"])
def test_a_preload_beyond_buckling_is_refused(tmp_path: Path, kind: Kind) -> None:
    """A column whose head may slide and turn buckles at pi^2 EI / (4 l^2) or less: the weight rides on its head."""
    alone = COLUMN + WEIGHT.replace("per_input = 0\n", "").replace("force_n_per_input = 1\n", "")
    limit_n = np.pi**2 * RIGIDITY_N_MM2 / (4.0 * 40.0**2)
    assert kind(drawn(tmp_path, f"{alone}preload_n = {0.2 * limit_n}\n")).stiffness_n_mm > 0.0
    with pytest.raises(ModelError, match=r"preload of 4\.4\d* N.*buckles"):
        _ = kind(drawn(tmp_path, f"{alone}preload_n = {0.99 * limit_n:.4g}\n")).driven
    with pytest.raises(ModelError, match="below the yield stress of 300 MPa"):
        response_figures(kind(drawn(tmp_path, STAGE + "preload_n = 30\n")))


def test_the_stiffness_matrix_refuses_a_preload(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="preload of drive"):
        RigidBodies(drawn(tmp_path, STAGE + "preload_n = 0.8\n"))


@pytest.mark.slow
def test_a_negative_stiffness_is_warned_of(tmp_path: Path) -> None:
    """Beyond Euler's load a stage holds the column straight; without it, the column would have no frequency."""
    figures = mechanism_figures(MechanismFrame(column(tmp_path, 20.0)))
    assert figures["input_stiffness_n_mm"] < 0.0
    assert "mode_1_drive_held_hz" in figures
    assert "mode_1_drive_free_hz" not in figures
    asked = [str(tmp_path / "mechanism.toml"), "--kind", "lumped", "--out", str(tmp_path / "out")]
    said = CliRunner().invoke(command, asked, catch_exceptions=False)
    assert "stiffness at the drive negative" in said.output
    assert "presses with 20 N" in said.output
