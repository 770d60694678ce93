"""Small-displacement response of a drawing's frame: three numbers, for drawings that are changed many times."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper
from fingervision.models.half_frame import half_frame
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.skeleton import skeleton_of
from fingervision.models.static_answer import gap_per_input

Array = NDArray[np.float64]

_SEGMENTS = 10
_FIRST_NODES, _MOST_NODES = 13, 97
_WITHIN = 1e-6


@dataclass(frozen=True, slots=True)
class SmallAnswer:
    """A linear gripper.

    Parameters
    ----------
    rest_gap_mm, gap_per_input, force_per_input_n_mm : float
        Gap at input zero; gap and force of both halves per millimetre of input.
    """

    rest_gap_mm: float
    gap_per_input: float
    force_per_input_n_mm: float


def small_answer(gripper: Gripper, theory: HingeTheory) -> SmallAnswer:
    """Compute the response by the frame of the lumped model, in a few milliseconds."""
    half = half_frame(gripper, skeleton_of(gripper, theory, _SEGMENTS))
    return SmallAnswer(2.0 * half.measured_rest_mm, gap_per_input(half), half.equilibrium(1.0).force_n)


@dataclass(frozen=True, eq=False)
class RatioCurves:
    """Gap and force relative to the drawing, as functions of a change of one of its dimensions.

    Parameters
    ----------
    change : ndarray of float, shape (k,)
        The number's change.
    gap, force : ndarray of float, shape (k,)
        Ratio of gap and of force per input to the drawing's own.
    """

    change: Array
    gap: Array
    force: Array

    def force_at_gap(self, gap_ratio: float) -> float:
        """Force ratio of the change that gives a gap ratio; both ratios are 1 without change."""
        return float(self._force(np.clip(gap_ratio, self.gap.min(), self.gap.max())))

    def gap_at_force(self, force_ratio: float) -> float:
        """Gap ratio of the change that gives a force ratio."""
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
        Of the hinges.
    change : callable
        Gives the drawing changed by so much.
    low, high : float
        Range of changes, about zero.

    Returns
    -------
    RatioCurves or None
        None where there is nothing to change, where the changed drawings are no grippers, or where the ratios turn
        back: no change could then be told from its ratio.
    """
    if not low < 0.0 < high:
        return None
    bare = small_answer(gripper, theory)

    def ratios(at: Array) -> Array:
        answers = [small_answer(change(float(x)), theory) for x in at]
        return np.array(
            [
                (a.gap_per_input / bare.gap_per_input, a.force_per_input_n_mm / bare.force_per_input_n_mm)
                for a in answers
            ]
        )

    nodes = np.union1d(np.linspace(low, high, _FIRST_NODES), 0.0)
    try:
        known = ratios(nodes)
        while nodes.size < _MOST_NODES:
            middles = 0.5 * (nodes[1:] + nodes[:-1])
            between = ratios(middles)
            error = float(np.abs(CubicSpline(nodes, known)(middles) - between).max())
            merged = np.argsort(np.concatenate([nodes, middles]))
            nodes = np.concatenate([nodes, middles])[merged]
            known = np.concatenate([known, between])[merged]
            if error < _WITHIN:
                break
    except FingervisionError:
        return None
    steps = np.diff(known, axis=0)
    if not np.all(np.abs(np.sign(steps).sum(axis=0)) == len(steps)):
        return None
    return RatioCurves(nodes, known[:, 0], known[:, 1])
