"""A gripper of two equal halves as one kind of model computes it: response, poses, stress and modes by name.

The drawing `gripper.toml` is expanded into the drawing of a mechanism (`gripper_mechanism.half_mechanism`), which any
elastic model solves; this module states the results in the terms of a gripper.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from fingervision.domain.gripper import Gripper
from fingervision.domain.made_again import MadeAgain
from fingervision.domain.response import Response
from fingervision.models.answer_figures import LoadedState, ModelFigures, PeakStress, Physics
from fingervision.models.elastic_mechanism import ElasticMechanism
from fingervision.models.mechanism_equilibrium import MechanismEquilibrium
from fingervision.models.modal_model import GAP, FreeModes, ModalModel

Array = NDArray[np.float64]

_MODES = 3
_LEAST_MM = 1e-3
_STEP_MM = 0.5
_NEAR_TOUCH = 0.9
_SAMPLES_BEYOND_TOUCH = 200
_MOST_EQUILIBRIA = 41
"""Most equilibria from which poses are interpolated: for the published sample a spline through 41 of them is within
0.02 um of a finer one."""
_CLOSING, _OPENING, _OF_HEIGHT = 1.5, 5.0, 0.01


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Relative model errors of slope, force, modes and grip; see `ModelFigures`."""

    slope: float
    force: float
    mode: float
    grip: float


def covered_inputs_mm(gripper: Gripper, first_touch_mm: float | None) -> tuple[float, float]:
    """Smallest and largest valid input: 1.5 times, and minus five times, the input of first touch.

    For the published gripper the range is -0.77 to 2.6 mm; its hinges begin to yield at the upper end. Outside this
    range the models still compute results, but these results must not be trusted. For a gripper whose fingers never
    touch, the range is a hundredth of the height in either direction.
    """
    if first_touch_mm is None:
        return -_OF_HEIGHT * gripper.body.height_mm, _OF_HEIGHT * gripper.body.height_mm
    ends = _CLOSING * first_touch_mm, -_OPENING * first_touch_mm
    return min(ends), max(ends)


class DrawnGripper(MadeAgain):
    """Model of a gripper with two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included.
    elastic : ElasticMechanism
        Model of the drawing as a mirrored mechanism.
    errors : ModelErrors
        Errors of this kind of model.
    """

    name: str

    def __init__(self, gripper: Gripper, physics: Physics, elastic: ElasticMechanism, errors: ModelErrors) -> None:
        self.gripper, self.physics, self.elastic, self.errors = gripper, physics, elastic, errors

    @property
    def rest_gap_mm(self) -> float:
        """The gap at zero input (mm)."""
        return 2.0 * self.gripper.measuring_point_mm[0]

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input for which the model is valid (mm)."""
        return covered_inputs_mm(self.gripper, self.first_touch_mm)

    @property
    def force_per_input_n_mm(self) -> float:
        """Force at the drive of both halves per 1 mm of input, at rest."""
        return self.elastic.stiffness_n_mm

    @cached_property
    def gap_per_input(self) -> float:
        """Ratio of gap to input (mm per mm), at zero input."""
        return self.gap_change_mm(self.elastic.driven.unit_displacement)

    def gap_change_mm(self, moved: Array) -> float:
        """Small change of the gap by displacements of the elastic model (mm)."""
        return 2.0 * float(self.elastic.motion_mm(moved, self.gripper.measuring_point_mm, large=False)[0])

    @cached_property
    def face_per_input(self) -> Array:
        """Motion of every point of the tip's inner face away from the symmetry axis per 1 mm of input."""
        driven = self.elastic.driven
        _, slope, _ = driven.gaps[0](np.zeros(driven.unknowns))
        return np.asarray(slope @ driven.unit_displacement)

    @cached_property
    def first_touch_mm(self) -> float | None:
        """Input at which the first point of the face meets the symmetry axis (mm); None if none moves towards it."""
        return self.reaches_mm(0.0)

    def reaches_mm(self, half_gap_mm: float) -> float | None:
        """Input at which the first point of the face is this far from the symmetry axis (mm); None if none closes."""
        closing = self.face_per_input > 0.0
        if not closing.any():
            return None
        way_mm = half_gap_mm - self.elastic.contact_points_mm[0][0]
        return float(np.max(way_mm[closing] / self.face_per_input[closing]))

    @cached_property
    def contact_onset_mm(self) -> float | None:
        """Input at which the fingers first touch (mm), in the deformed shape if the physics includes it."""
        touch = self.first_touch_mm
        return touch if touch is None or not self.physics.large_rotation else self.elastic.driven.first_touch(touch)

    def equilibria(self, inputs_mm: Sequence[float], *, contact: bool | None = None) -> list[MechanismEquilibrium]:
        """Equilibria at the given inputs, with the physics that the model includes."""
        touch, stopped = self.first_touch_mm, self.physics.contact if contact is None else contact
        return [
            self.elastic.driven.equilibrium(
                value,
                large_rotation=self.physics.large_rotation,
                contact=stopped and touch is not None and value < _NEAR_TOUCH * touch,
            )
            for value in inputs_mm
        ]

    def loaded(self, inputs_mm: Sequence[float]) -> list[LoadedState]:
        """Gap, forces and largest stress at the given inputs."""
        return [self.stressed(at, found) for at, found in zip(inputs_mm, self.equilibria(inputs_mm), strict=True)]

    def stressed(self, input_mm: float, found: MechanismEquilibrium) -> LoadedState:
        """Gap, forces and largest stress of one equilibrium."""
        stress = self.elastic.peak_stress(found.displacement, large=self.physics.large_rotation)
        grip_n = sum(float(part.sum()) for part in found.pressed_n) / self.elastic.mechanism.halves
        return LoadedState(input_mm, self._gap_mm(found), found.force_n, grip_n, stress.mpa, stress.place_mm)

    def _gap_mm(self, found: MechanismEquilibrium) -> float:
        return self.elastic.pairs_mm(found.displacement, large=self.physics.large_rotation)["gap"]

    def peak_stress(self) -> PeakStress:
        """Largest stress in the hinges per 1 mm of input, for small displacements."""
        stress = self.elastic.peak_stress(self.elastic.driven.unit_displacement)
        return PeakStress(stress.mpa, stress.place_mm)

    def respond(self, input_mm: Array) -> Response:
        """Compute the static response at each input."""
        inputs = np.asarray(input_mm, dtype=float)
        touch = self.first_touch_mm if self.physics.contact else None
        if self.physics.large_rotation:
            gap, force = self._large(inputs, touch)
        else:
            gap = self.rest_gap_mm + self.gap_per_input * inputs
            force = self.force_per_input_n_mm * inputs
            if touch is not None and np.any(inputs < touch):
                # Linear complementarity: the response is piecewise linear, with a kink where another point touches.
                at = np.linspace(float(inputs.min()), touch, _SAMPLES_BEYOND_TOUCH)
                beyond = inputs < touch
                for values, curve in zip((gap, force), self._curve(at), strict=True):
                    values[beyond] = np.interp(inputs[beyond], at, curve)
        return Response(left_mm=-0.5 * gap, right_mm=0.5 * gap, force_n=force)

    def _large(self, inputs: Array, touch_mm: float | None) -> tuple[Array, Array]:
        """Gap and force over the inputs, from a cubic spline through equilibria along the path from rest."""
        lowest = min(float(inputs.min(initial=0.0)), -_LEAST_MM)
        highest = max(float(inputs.max(initial=0.0)), _LEAST_MM)
        pressed = np.zeros(0)
        if touch_mm is not None and lowest < _NEAR_TOUCH * touch_mm:
            first = self.elastic.driven.first_touch(touch_mm)
            if lowest < first:
                pressed, lowest = _steps(lowest, first)[:-1], first
        at = np.union1d(_steps(lowest, 0.0), _steps(0.0, highest))
        gap, force = self._curve(at, contact=False)
        smooth = CubicSpline(at, gap)(inputs), CubicSpline(at, force)(inputs)
        if pressed.size:
            # The curve has a kink where the tip first touches; beyond it, the curve is straight within 1 in 1000.
            beyond = inputs < lowest
            nodes = np.append(pressed, lowest)
            ends = (gap[0], force[0])
            for values, curve, end in zip(smooth, self._curve(pressed), ends, strict=True):
                values[beyond] = np.interp(inputs[beyond], nodes, np.append(curve, end))
        return smooth

    def _curve(self, inputs: Array, *, contact: bool | None = None) -> tuple[Array, Array]:
        # Equilibria in the deformed shape are followed from rest outwards.
        order = np.argsort(np.abs(inputs), kind="stable")
        found = dict(zip(order.tolist(), self.equilibria(inputs[order].tolist(), contact=contact), strict=True))
        states = [found[place] for place in range(inputs.size)]
        return np.array([self._gap_mm(state) for state in states]), np.array([state.force_n for state in states])

    def body_poses(self, input_mm: Array) -> dict[str, Array]:
        """Poses of both fingers and the drive at each input: x_mm, y_mm, angle_mrad, shape (n, 3) each."""
        inputs, large = np.asarray(input_mm, dtype=float), self.physics.large_rotation
        if not large and not self.physics.contact:
            poses = self.elastic.poses(self.elastic.driven.unit_displacement, large=False)
            found = {name: np.outer(inputs, [pose.x_mm, pose.y_mm, pose.angle_mrad]) for name, pose in poses.items()}
        else:
            nodes = np.unique(inputs)
            if nodes.size > _MOST_EQUILIBRIA:
                nodes = np.linspace(nodes[0], nodes[-1], _MOST_EQUILIBRIA)
            states = [
                {name: [pose.x_mm, pose.y_mm, pose.angle_mrad] for name, pose in poses.items()}
                for poses in (self.elastic.poses(s.displacement, large=large) for s in self.equilibria(nodes.tolist()))
            ]
            found = {name: _through(nodes, np.array([s[name] for s in states]), inputs) for name in states[0]}
        return {name: rows + 0.0 for name, rows in sorted(found.items())}  # no -0.0

    def modes_hz(self, *, drive_held: bool, count: int = _MODES) -> tuple[float, ...]:
        """First symmetric in-plane natural frequencies, without the actuator's mass."""
        return self.elastic.modes_hz(drive_held=drive_held, count=count)

    def swaying_modes_hz(self, *, count: int = 1) -> tuple[float, ...]:
        """First antisymmetric in-plane natural frequencies, with the drive free to move sideways (Hz)."""
        return self.elastic.swaying.modes_hz(drive_held=True, count=count)

    def midline_by_weight_mm(self) -> float:
        """Shift of the midline when the plate stands on its side: both halves sway in the same direction (mm).

        The drive is fixed along its axis and free across it, because the actuator does not guide it sideways.
        """
        sways = self.elastic.swaying
        moved = sways.under_weight((1.0, 0.0))
        return float(sways.motion_mm(moved, self.gripper.measuring_point_mm, large=False)[0])

    def modal_model(self, count: int) -> ModalModel:
        """Reduce the gripper to its modes with the drive held, with both halves moving as mirror images."""
        reduced = self.elastic.modal_model(count)
        return replace(reduced, observed={GAP: reduced.observed[GAP]})

    def free_modes(self, count: int) -> FreeModes:
        """Return the modes with the drive free, with both halves moving as mirror images."""
        modes = self.elastic.free_modes(count)
        return replace(modes, by_mode={GAP: modes.by_mode[GAP]})

    def figures(self) -> ModelFigures:
        """Characteristic numbers (slope, stiffness, stress, frequencies) of the model for the comparison table."""
        errors = self.errors
        return ModelFigures(
            self.gap_per_input,
            self.force_per_input_n_mm,
            self.peak_stress(),
            self.modes_hz(drive_held=False),
            self.modes_hz(drive_held=True),
            self.contact_onset_mm,
            self.swaying_modes_hz(),
            slope_error=errors.slope,
            force_error=errors.force,
            mode_error=errors.mode,
            grip_error=errors.grip,
        )


def _steps(first_mm: float, last_mm: float) -> Array:
    """Inputs of a curve through equilibria: at least three steps of at most 0.5 mm."""
    return np.linspace(first_mm, last_mm, max(3, int(np.ceil(abs(last_mm - first_mm) / _STEP_MM))) + 1)


def _through(nodes: Array, rows: Array, inputs: Array) -> Array:
    if nodes.size == 1:
        return np.repeat(rows, inputs.size, axis=0)
    return np.asarray(PchipInterpolator(nodes, rows)(inputs))
