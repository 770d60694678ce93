"""Small-displacement response of a drawing, reduced to three numbers: fast enough for many changed drawings."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper

Array = NDArray[np.float64]

_NODES = 49
"""Drawings of which the responses are tabulated: a spline through them is within 1e-6 of those of the published sample
and of the micro gripper, with half as many within 1.4e-5."""


@dataclass(frozen=True, slots=True)
class SmallAnswer:
    """Small-displacement response of a gripper: a linear relation of gap and force to the input.

    Parameters
    ----------
    rest_gap_mm, gap_per_input, force_per_input_n_mm : float
        Gap at zero input; gap per millimetre of input; force of both halves per millimetre of input.
    """

    rest_gap_mm: float
    gap_per_input: float
    force_per_input_n_mm: float


def small_answer(gripper: Gripper, theory: HingeTheory) -> SmallAnswer:
    """Compute the response by the frame of bars, in a few milliseconds."""
    bars = StiffnessMatrixGripper(gripper, theory=theory)
    return SmallAnswer(bars.rest_gap_mm, bars.gap_per_input, bars.force_per_input_n_mm)


@dataclass(frozen=True, eq=False)
class RatioCurves:
    """Ratios of gap and force to those of the drawing, as functions of a change of one dimension.

    Parameters
    ----------
    change : ndarray of float, shape (k,)
        Change of the dimension.
    gap, force : ndarray of float, shape (k,)
        Ratio of gap per input, and of force per input, to those of the unchanged drawing.
    """

    change: Array
    gap: Array
    force: Array

    def force_at_gap(self, gap_ratio: float) -> float:
        """Force ratio for that change of the dimension for which the gap ratio has a given value."""
        return float(self._force(np.clip(gap_ratio, self.gap.min(), self.gap.max())))

    def gap_at_force(self, force_ratio: float) -> float:
        """Gap ratio for that change of the dimension for which the force ratio has a given value."""
        return float(self._gap(np.clip(force_ratio, self.force.min(), self.force.max())))

    @cached_property
    def _force(self) -> CubicSpline:
        order = np.argsort(self.gap)
        return CubicSpline(self.gap[order], self.force[order])

    @cached_property
    def _gap(self) -> CubicSpline:
        order = np.argsort(self.force)
        return CubicSpline(self.force[order], self.gap[order])


def ratio_curves(gripper: Gripper, theory: HingeTheory, change: Callable[[float], Gripper], low: float, high: float,
                 ) -> RatioCurves | None:  # fmt: skip
    """Tabulate the responses of changed drawings, finely enough for a spline accurate to 1e-6.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.
    change : callable
        Maps an amount of change to the changed drawing.
    low, high : float
        Range of the change, which includes zero.

    Returns
    -------
    RatioCurves or None
        None if there is nothing to change, if the changed drawings are not valid grippers, or if a ratio is not
        monotonic, so that it does not determine the change.
    """
    if not low < 0.0 < high:
        return None
    bare = small_answer(gripper, theory)
    nodes = np.union1d(np.linspace(low, high, _NODES), 0.0)
    try:
        answers = [small_answer(change(float(by)), theory) for by in nodes]
    except FingervisionError:
        return None
    known = np.array([
        (each.gap_per_input / bare.gap_per_input, each.force_per_input_n_mm / bare.force_per_input_n_mm)
        for each in answers
    ])  # fmt: skip
    steps = np.diff(known, axis=0)
    if not np.all(np.abs(np.sign(steps).sum(axis=0)) == len(steps)):
        return None
    return RatioCurves(nodes, known[:, 0], known[:, 1])


# Data from which effects of a drawing are computed: drawing, elastic body, response to a changed lever.


@dataclass(frozen=True, slots=True, eq=False)
class DrawnAnswer:
    """A drawing and its elastic response, as computed by one kind of model.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.
    model : DrawnGripper
        The gripper for small displacements, as this kind of model computes it.
    input_range_mm : (float, float)
        Smallest and largest input for which the model is valid.
    lever : RatioCurves or None
        Ratio of changed to unchanged response over the input, for a change of the length l2 of the lever arm that
        determines the amplification.
    """

    gripper: Gripper
    theory: HingeTheory
    model: DrawnGripper
    input_range_mm: tuple[float, float]
    lever: RatioCurves | None
