"""Propagated uncertainties against plain Monte Carlo simulation of closed formulas and of the frame."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from scipy.special import ndtri

from fingervision.domain.errors import FingervisionError, ModelError
from fingervision.domain.gripper import Gripper
from fingervision.domain.parameter import Estimate
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.small_answer import small_answer
from fingervision.models.uncertainty import gripper_uncertainty, propagate

ENDS = np.array([-0.5, 1.5])


def test_a_straight_figure_is_propagated_linearly() -> None:
    """3 a - 4 b with u of 0.1 and 0.2: sqrt(0.3^2 + 0.8^2)."""
    numbers = {"a": Estimate(1.0, 0.1), "b": Estimate(2.0, 0.2)}

    def evaluate(by: Mapping[str, float]) -> dict[str, float | None]:
        return {"y": 3.0 * (1.0 + by.get("a", 0.0)) - 4.0 * (2.0 + by.get("b", 0.0)), "none": None, "still": 5.0}

    found = propagate(evaluate, numbers)
    assert list(found) == ["y"]
    assert not found["y"].sampled
    assert found["y"].u == pytest.approx(np.hypot(0.3, 0.8))
    assert found["y"].shares[0] == ("b", pytest.approx(0.64 / 0.73))


def test_a_bent_figure_is_sampled() -> None:
    """x^-2.5 with 10 % uncertainty, compared with two million normal draws of numpy."""
    found = propagate(lambda by: {"y": (1.0 + by.get("x", 0.0)) ** -2.5}, {"x": Estimate(1.0, 0.1)}, samples=512)["y"]
    many = (1.0 + 0.1 * np.random.default_rng(5).standard_normal(2_000_000)) ** -2.5
    assert found.sampled
    assert found.u == pytest.approx(many.std(), rel=0.05)
    assert found.mean == pytest.approx(many.mean(), rel=0.005)
    assert found.interval == pytest.approx(np.quantile(many, [0.025, 0.975]), rel=0.03)


def test_a_figure_at_its_extreme_has_an_uncertainty() -> None:
    """x^2 at 0 has no slope: its uncertainty u^2 sqrt(2) comes from the curvature alone."""
    found = propagate(lambda by: {"y": 7.0 + by.get("x", 0.0) ** 2}, {"x": Estimate(0.0, 0.3)}, samples=1024)["y"]
    assert found.sampled
    assert found.u == pytest.approx(0.09 * np.sqrt(2.0), rel=0.1)
    assert found.shares == (("x", pytest.approx(1.0)),)


def test_numbers_that_leave_no_drawing_are_refused() -> None:
    def evaluate(by: Mapping[str, float]) -> dict[str, float | None]:
        if by.get("x", 0.0) > 0.05:
            raise FingervisionError("x must be at most 1.05.")
        return {"y": by.get("x", 0.0)}

    with pytest.raises(ModelError, match=r"The uncertainty of x is too large: with x = 1.1, .* at most 1.05"):
        propagate(evaluate, {"x": Estimate(1.0, 0.1)})

    def bent(by: Mapping[str, float]) -> dict[str, float | None]:
        if by.get("x", 0.0) > 0.11:
            raise FingervisionError("x must be at most 1.11.")
        return {"y": (1.0 + by.get("x", 0.0)) ** -3}

    with pytest.raises(ModelError, match=r"stated uncertainties are too large: of 128 .*, \d+ cannot be computed"):
        propagate(bent, {"x": Estimate(1.0, 0.1)})


@pytest.mark.slow
def test_linear_propagation_against_monte_carlo_of_the_frame(gripper: Gripper) -> None:
    """Gap and force per input, for 600 drawings with four randomly changed dimensions."""
    u = {"hinge.thickness_mm": 0.03, "hinge.radius_mm": 0.1, "material.youngs_modulus_mpa": 80.0, "body.plate_mm": 0.05}
    found = gripper_uncertainty(replace(gripper, uncertainties=MappingProxyType(u)), ENDS)
    rng = np.random.default_rng(11)
    rows = []
    for t, r, e, b in rng.standard_normal((600, 4)):
        drawn = replace(
            gripper,
            hinge=replace(gripper.hinge, thickness_mm=1.0 + 0.03 * t, radius_mm=4.0 + 0.1 * r),
            material=replace(gripper.material, youngs_modulus_mpa=1650.0 + 80.0 * e),
            body=replace(gripper.body, plate_mm=3.0 + 0.05 * b),
        )
        answer = small_answer(drawn, HingeTheory.CORRECTED)
        rows.append((answer.gap_per_input, answer.force_per_input_n_mm))
    gap, force = np.std(rows, axis=0)
    # 600 draws determine a standard deviation within 2.9 %.
    assert found["gap_per_input"].u == pytest.approx(gap, rel=0.1)
    assert found["input_stiffness_n_mm"].u == pytest.approx(force, rel=0.1)
    assert not found["input_stiffness_n_mm"].sampled
    assert found["input_stiffness_n_mm"].shares[0][0] == "hinge.thickness_mm"


@pytest.mark.slow
def test_sampled_propagation_against_monte_carlo_of_the_frame(gripper: Gripper) -> None:
    """A printed hinge of 1.0 +- 0.1 mm: the compliance is proportional to t^-2.5, far from linear."""
    u = MappingProxyType({"hinge.thickness_mm": 0.1})
    found = gripper_uncertainty(replace(gripper, uncertainties=u), ENDS)["midline_by_weight_mm"]
    assert found.sampled
    # The midpoints of 60 intervals of equal probability of the normal distribution replace many draws.
    shifts = [
        LumpedGripper(replace(gripper, hinge=replace(gripper.hinge, thickness_mm=1.0 + 0.1 * z))).midline_by_weight_mm()
        for z in ndtri((np.arange(60) + 0.5) / 60).tolist()
    ]
    assert found.mean == pytest.approx(np.mean(shifts), rel=0.01)
    assert found.u == pytest.approx(np.std(shifts), rel=0.1)
    assert found.interval == pytest.approx(np.quantile(shifts, [0.025, 0.975]), rel=0.06)
    assert found.mean > found.value


@pytest.mark.parametrize(
    ("name", "u", "sentence"),
    [
        ("hinge.thickness_mm", 1.5, r"The uncertainty of hinge.thickness_mm is too large: .* must be positive"),
        ("material.poisson_ratio", 0.2, "must be below 0.5, but its uncertainty includes 0.54"),
        ("hinge.radius_mm", 3.0, "The uncertainty of hinge.radius_mm is too large"),
    ],
)
def test_uncertainties_beyond_sense_are_refused(gripper: Gripper, name: str, u: float, sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence):
        gripper_uncertainty(replace(gripper, uncertainties=MappingProxyType({name: u})), ENDS)
