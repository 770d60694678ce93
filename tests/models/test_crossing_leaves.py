"""Leaves that cross in one layer are one piece: against wedge elements of CalculiX, and where they cross."""

from pathlib import Path

import pytest

from fingervision.domain.errors import DataError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from tests.drawings import drawing

CROSS = """
plate_mm = 6.0
material = { name = "al", youngs_modulus_mpa = 71000.0, poisson_ratio = 0.33, density_kg_m3 = 2810, yield_mpa = 420.0 }
[[body]]
name = "ground"
box_mm = [-15, 15, -8, 0]
[[body]]
name = "arm"
box_mm = [-15, 15, 20, 28]
[[flexure]]
name = "a"
kind = "leaf"
at_mm = [0, 10]
axis_deg = 45
thickness_mm = 0.5
half_length_mm = "10 * sqrt(2) + 1"
[[copy]]
of = ["a"]
mirror_x_mm = 0
suffix = " mirrored"
[[fixed]]
box_mm = [-15, 15, -8, -8]
[drive]
box_mm = [-15, -15, 20, 28]
direction = [1, 0]
across = "free"
"""
SOLID_N_MM = 6.9557
"""Force by `tests/benchmarks/solid_reference.py`: 4 layers, 3340 wedges each."""


def test_leaves_that_cross_are_fused_as_in_three_dimensions(tmp_path: Path) -> None:
    mechanism = drawing(tmp_path, CROSS, "cross")
    assert mechanism.fused == (("a", "a mirrored", pytest.approx((0.0, 10.0))),)
    assert [flexure.name for flexure in mechanism.flexures] == [
        "a part 1", "a part 2", "a mirrored part 1", "a mirrored part 2",
    ]  # fmt: skip
    for kind in (MechanismPlate, MechanismFrame):
        assert kind(mechanism).stiffness_n_mm == pytest.approx(SOLID_N_MM, rel=0.005)


def test_a_part_ends_in_the_crossing_and_a_leaf_does_not_end_in_the_void(tmp_path: Path) -> None:
    ((_, _, place),) = drawing(tmp_path, CROSS.replace("mirror_x_mm = 0", "mirror_x_mm = 1")).fused
    assert place == pytest.approx((1.0, 11.0))
    with pytest.raises(DataError, match=r"1\.945"):
        drawing(tmp_path, CROSS.replace("sqrt(2) + 1", "sqrt(2) - 3"))
