"""Weight, temperature and a part between two probes of a mechanism, against springs, loads and levers."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve
from skfem.helpers import ddot, eye, grad, trace, transpose

from fingervision.models.finite_element import MechanismPlate
from fingervision.models.grip import Part
from fingervision.models.mechanism_figures import GrippedPair, operating_figures_of
from fingervision.storage.mechanism_toml import mechanism_from_tables

ARM_MM, END_MM, BEAK_MM = 12.0, 14.0, 48.0
LEVER = f"""
name = "lever and anvil"
plate_mm = 5.0
[material]
name = "aluminium"
youngs_modulus_mpa = 70000.0
poisson_ratio = 0.33
density_kg_m3 = 2800.0
yield_mpa = 500.0
thermal_expansion_per_k = 23e-6
[[body]]
name = "ground"
box_mm = [-20, 60, -10, 0]
[[body]]
name = "post"
box_mm = [-5, 5, -1, 11]
[[body]]
name = "lever"
box_mm = [{-END_MM}, 60, 10, 30]
[[body]]
name = "anvil"
box_mm = [{BEAK_MM - 3.0}, {BEAK_MM + 3.0}, -1, 8]
[[flexure]]
name = "pivot"
kind = "circular"
at_mm = [0, 5]
axis_deg = 90
thickness_mm = 0.3
radius_mm = 5
[[fixed]]
box_mm = [-20, 60, -10, -10]
[drive]
box_mm = [{-ARM_MM - 1.0}, {-ARM_MM + 1.0}, 30, 30]
direction = [0, 1]
across = "free"
turns = "held"
[[probe]]
name = "below"
at_mm = [{BEAK_MM}, 8]
[[probe]]
name = "above"
at_mm = [{BEAK_MM}, 10]
[[pair]]
name = "gap"
of = ["below", "above"]
"""


@pytest.fixture(scope="module")
def model() -> MechanismPlate:
    return MechanismPlate(mechanism_from_tables(tomllib.loads(LEVER), "lever.toml"), refine=0.6)


def test_a_part_is_a_spring_between_the_probes(model: MechanismPlate) -> None:
    """The stiffness matrix of a spring is added to that of the plate, and both are solved together."""
    part = Part(1.9, 300.0)
    pressed = GrippedPair(model, "gap").at(0.1, part)
    plate = model.plate
    rows = model.probe_rows["above"][1] - model.probe_rows["below"][1]
    row = csr_matrix(rows)
    stiffness = plate.stiffness_n_mm + part.stiffness_n_mm * (row.T @ row)
    x, y = plate.nodes_mm
    driven = plate.y_dofs[(np.abs(y - 30.0) < 1e-9) & (np.abs(x + ARM_MM) <= 1.0 + 1e-9)]
    foot = np.abs(y + 10.0) < 1e-9
    moved = np.zeros(plate.unknowns)
    moved[driven] = 0.1
    free = np.setdiff1d(np.arange(plate.unknowns), np.concatenate([driven, plate.x_dofs[foot], plate.y_dofs[foot]]))
    # The part is touched after 0.1 mm of closing: the spring acts from this point.
    load = part.stiffness_n_mm * (part.width_mm - 2.0) * rows - stiffness @ moved
    moved[free] = spsolve(stiffness[free][:, free].tocsc(), load[free])
    assert pressed.grip_n == pytest.approx(-part.stiffness_n_mm * (2.0 + rows @ moved - part.width_mm), rel=1e-6)
    assert pressed.force_n == pytest.approx(float((plate.stiffness_n_mm @ moved)[driven].sum()), rel=1e-6)
    assert pressed.distance_mm == pytest.approx(2.0 + rows @ moved, abs=1e-9)
    assert GrippedPair(model, "gap").at(0.0, Part(1.9)).grip_n == 0.0


def test_a_lever_s_advantage_is_the_ratio_of_its_arms() -> None:
    """The drive acts along the lever's end, which may rotate; the missing force bends the pivot."""
    text = LEVER.replace(
        f"box_mm = [{-ARM_MM - 1.0}, {-ARM_MM + 1.0}, 30, 30]", f"box_mm = [{-END_MM}, {-END_MM}, 10, 30]"
    ).replace('turns = "held"\n', "")
    pair = GrippedPair(MechanismPlate(mechanism_from_tables(tomllib.loads(text), "lever.toml"), refine=0.6), "gap")
    assert pair.mechanical_advantage == pytest.approx(END_MM / BEAK_MM, rel=0.02)
    assert pair.mechanical_advantage < END_MM / BEAK_MM


def test_warmth_is_the_thermal_strain_of_the_elements(model: MechanismPlate) -> None:
    """Compared with a thermal load by scikit-fem, with fixed drive and foot."""
    plate, material = model.plate, model.mechanism.material
    nu, E, expansion = material.poisson_ratio, material.youngs_modulus_mpa, material.thermal_expansion_per_k or 0.0
    bare = MechanismPlate(model.mechanism, width_effect=False, refine=0.6)

    @skfem.LinearForm
    def warm(v, w):  # type: ignore[no-untyped-def]
        strain = expansion * eye(np.ones(w.x.shape[1:]), 2)
        stress = E / (1.0 + nu) * strain + E * nu / (1.0 - nu**2) * eye(trace(strain), 2)
        return 5.0 * ddot(stress, 0.5 * (grad(v) + transpose(grad(v))))

    tri = skfem.MeshTri2(bare.mesh.nodes_mm, bare.mesh.triangles)
    load = warm.assemble(skfem.Basis(tri, skfem.ElementVector(skfem.ElementTriP2()), intorder=4))
    x, y = bare.plate.nodes_mm
    driven = bare.plate.y_dofs[(np.abs(y - 30.0) < 1e-9) & (np.abs(x + ARM_MM) <= 1.0 + 1e-9)]
    foot = np.abs(y + 10.0) < 1e-9
    held = np.concatenate([driven, bare.plate.x_dofs[foot], bare.plate.y_dofs[foot]])
    free = np.setdiff1d(np.arange(bare.plate.unknowns), held)
    K = bare.plate.stiffness_n_mm
    moved = np.zeros(bare.plate.unknowns)
    moved[free] = spsolve(K[free][:, free].tocsc(), load[free])
    figures = operating_figures_of(bare)
    wanted = (bare.probe_rows["above"][1] - bare.probe_rows["below"][1]) @ moved
    assert figures["gap: per kelvin [mm/K]"] == pytest.approx(wanted, rel=1e-5)
    assert figures["force_per_kelvin_n"] == pytest.approx(float((K @ moved - load)[driven].sum()), rel=1e-4)
    assert plate.unknowns == bare.plate.unknowns


def test_a_cantilever_hangs_by_its_weight() -> None:
    """Deflection w L^4 / (8 E I) of a bar whose root is driven along the bar and at rest."""
    bar = (
        LEVER[: LEVER.index("[[body]]")]
        + """
[[body]]
box_mm = [0, 100, 0, 4]
[[fixed]]
box_mm = [0, 0, 0, 1.5]
[drive]
box_mm = [0, 0, 2.5, 4]
direction = [1, 0]
across = "held"
[[probe]]
name = "end"
at_mm = [100, 2]
"""
    )
    drawing = mechanism_from_tables(tomllib.loads(bar), "bar.toml")
    figures = operating_figures_of(MechanismPlate(replace(drawing, plate_mm=2.0)))
    sag = 2.8e-9 * 9806.65 * 4.0 * 100.0**4 / (8.0 * 70e3 * 4.0**3 / 12.0)
    assert figures["end: moved by its weight along -y [mm]"] == pytest.approx(sag, rel=0.01)
