"""Buckling of leaves: Euler's columns, and mechanisms whose leaves bend and do not buckle."""

from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from fingervision.models.elastic_mechanism import ElasticMechanism
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism_figures import mechanism_figures
from fingervision.storage.mechanism_toml import read_mechanism
from tests.drawings import drawing
from tests.models.coarse import coarse_elements

COLUMN = """
plate_mm = 2.0
material = { name = "m", youngs_modulus_mpa = 1000.0, poisson_ratio = 0.0, density_kg_m3 = 1000.0, yield_mpa = 40.0 }
[[body]]
box_mm = [-10, 10, -10, 0]
[[body]]
box_mm = [-10, 10, 60, 70]
[[flexure]]
kind = "leaf"
at_mm = [0, 30]
axis_deg = 90
thickness_mm = 0.4
half_length_mm = 30.5
[[fixed]]
box_mm = [-10, 10, -10, -10]
[drive]
box_mm = [-10, 10, 70, 70]
direction = [0, -1]
"""
LENGTH, STIFFNESS = 60.0, 1000.0 * 2.0 * 0.4**3 / 12.0
HEAD = 10.0
"""Height of the rigid block above the leaf, at whose top the force acts."""
# A column that is free at its top carries a rigid block: kL tan(kL) = L / height of the block.
FREE = brentq(lambda x: x * np.tan(x) - LENGTH / HEAD, 0.1, 1.5) ** 2


@pytest.mark.parametrize(
    ("ends", "factor"),
    [
        ('across = "held"\nturns = "held"', 4.0 * np.pi**2),
        ('across = "free"\nturns = "held"', np.pi**2),
        ('across = "free"\nturns = "free"', FREE),
    ],
)
def test_a_column_buckles_at_the_force_of_euler(ends: str, factor: float, tmp_path: Path) -> None:
    model = coarse_elements(drawing(tmp_path, COLUMN + ends + "\nforce_n_per_input = 0.1\n", "column"))
    _, pushed = model.buckling_inputs_mm()
    # The elastic bodies let the ends of the leaf turn a little: it is longer by about its thickness.
    assert 0.1 * pushed == pytest.approx(factor * STIFFNESS / (LENGTH + 0.4) ** 2, rel=0.01)


def test_a_column_pushed_by_a_stage_buckles_at_the_same_force(tmp_path: Path) -> None:
    model = coarse_elements(drawing(tmp_path, COLUMN + 'across = "held"\n', "column"))
    pushed = model.buckling_inputs_mm()[1]
    assert mechanism_figures(model)["input_at_buckling_mm"] == pytest.approx(pushed)
    force = pushed * model.stiffness_n_mm
    assert force == pytest.approx(4.0 * np.pi**2 * STIFFNESS / (LENGTH + 0.4) ** 2, rel=0.01)


def test_leaves_that_bend_do_not_buckle_before_they_yield() -> None:
    """Also a drawing of more than 46 341 unknowns, whose matrix has positions beyond 32 bits."""
    model = MechanismPlate(
        read_mechanism(Path(str(resources.files("fingervision.models") / "mechanisms" / "butterfly_pivot.toml")))
    )
    assert model.plate.unknowns > 2**15.5
    yields = model.mechanism.material.yield_mpa / model.state(1.0).stress_mpa
    assert np.abs(model.buckling_inputs_mm()).min() > yields


@pytest.mark.parametrize("kind", [coarse_elements, MechanismFrame])
def test_a_leaf_that_ends_at_the_bodies_edges_is_one_that_ends_inside(
    kind: Callable[..., ElasticMechanism], tmp_path: Path
) -> None:
    forces = []
    for half_mm in ("30.0", "30.5"):
        text = COLUMN.replace("30.5", half_mm).replace("[0, -1]", "[1, 0]")
        forces.append(kind(drawing(tmp_path, text)).stiffness_n_mm)
    assert forces[0] == pytest.approx(forces[1], rel=0.002)
