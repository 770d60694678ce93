"""The gripper as a chain of lumped flexures and elastic links, as in the SimMechanics model of Hricko & Havlik (2015).

Each notch is divided into segments, closer together at the neck. Each segment's compliance is the integral over it, so
that their sum is the notch's compliance up to rounding, however thin the notch is. The remaining error is that of beam
theory, which the correction of the hinges removes.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.domain.response import Response
from fingervision.models.answer_figures import LoadedState, ModelFigures, PeakStress
from fingervision.models.covered_inputs import covered_inputs_mm
from fingervision.models.driven_body import Equilibrium
from fingervision.models.gripper_bodies import gripper_poses, poses_of_frame
from fingervision.models.half_frame import frame_of, half_frame
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.hinge_stress import peak_hinge_stress, peak_in_deformed_shape
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.skeleton import skeleton_of
from fingervision.models.static_answer import (
    contact_onset_mm,
    equilibria,
    gap_per_input,
    loaded_state,
    symmetric_response,
)

KIND = "lumped"
TRUST, WHY_TRUSTED = 2, "both take the body for bars, and it has more of them"

_SEGMENTS = 10
_MODES = 3
_SLOPE_ERROR, _FORCE_ERROR = 0.01, 0.03
"""Of bars joined at points, beside finite elements of other grippers (`tests/benchmarks/models_held_out.py`)."""
_MODE_ERROR, _GRIP_ERROR = 0.07, 0.1
_NARROW, _MODE_ERROR_OF_NARROW, _GRIP_ERROR_OF_NARROW = 0.8, 0.2, 0.35
"""Where the finger is pushed back, bars bend up to where their axes meet and the body does not: the force on a part is
1 to 9 % off for the sample's proportions, and 31 % (its first mode 18 %) where the cross bar is 5 mm wide between bars
of 9 mm (`python -m tests.benchmarks.models_grip`). Narrow is less than 0.8 of the widest bar that it carries."""


class LumpedGripper:
    """Segments and bars of two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        What goes beyond small displacements.
    theory : HingeTheory
        Of the hinges.
    segments : int
        Per notch; the paper's n.
    block : ndarray of float, shape (3, 3), or None
        `drive_block_root.unit_compliance` of the drive block, where known already.
    """

    name = KIND

    def __init__(
        self,
        gripper: Gripper,
        physics: Physics = LINEAR,
        theory: HingeTheory = HingeTheory.CORRECTED,
        segments: int = _SEGMENTS,
        block: NDArray[np.float64] | None = None,
    ) -> None:
        self.gripper = gripper
        self.physics = physics
        self.theory = theory
        self.skeleton = skeleton_of(gripper, theory, segments, block=block)
        self.frame = frame_of(gripper, self.skeleton)
        self.half = half_frame(gripper, self.skeleton, self.frame)

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input for which the model is meant (mm)."""
        return covered_inputs_mm(self.gripper, self.half.first_touch_mm())

    @property
    def rest_gap_mm(self) -> float:
        """The gap at input zero (mm)."""
        return 2.0 * self.half.measured_rest_mm

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """Respond statically at each input."""
        return symmetric_response(self.half, self.physics, input_mm)

    def body_poses(self, input_mm: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Poses of the bodies at each input: x_mm, y_mm, angle_mrad, shape (n, 3) each."""
        poses = poses_of_frame(self.gripper, self.skeleton, large=self.physics.large_rotation)
        return gripper_poses(self.half, self.physics, poses, input_mm)

    def peak_stress(self) -> PeakStress:
        """Largest stress in the hinges per 1 mm of input, in the notch or, by beam theory, nominal."""
        return peak_hinge_stress(self.gripper, self.skeleton, self.half.unit_displacement_mm, self.theory)

    def equilibria(self, inputs_mm: Sequence[float]) -> list[Equilibrium]:
        """Equilibria at the given inputs, with the physics that the model includes."""
        return equilibria(self.half, self.physics, inputs_mm)

    def loaded(self, inputs_mm: Sequence[float]) -> list[LoadedState]:
        """Gap, forces and largest nominal stress at the given inputs, with the physics that the model includes."""
        return [self.stressed(state) for state in self.equilibria(inputs_mm)]

    def stressed(self, state: Equilibrium) -> LoadedState:
        """Gap, forces and largest nominal stress of one equilibrium."""
        moved = state.displacement_mm
        if self.physics.large_rotation:
            peak = peak_in_deformed_shape(self.gripper, self.skeleton, self.frame, moved, self.theory)
        else:
            peak = peak_hinge_stress(self.gripper, self.skeleton, moved, self.theory)
        return loaded_state(self.half, state, peak.mpa_per_mm, peak.place_mm)

    def modes_hz(self, *, drive_held: bool, count: int = _MODES) -> tuple[float, ...]:
        """First symmetric in-plane natural frequencies, without the actuator's mass."""
        rad_s, _ = self.half.modes(drive_held=drive_held, count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def swaying_modes_hz(self, *, count: int = 1) -> tuple[float, ...]:
        """First antisymmetric in-plane natural frequencies, with the drive free to move sideways (Hz)."""
        rad_s, _ = self.half.swaying_modes(count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    @property
    def _joint_errors(self) -> tuple[float, float]:
        """Relative errors of the modes and of the grip from modelling the joint of cross bar, shuttle and finger."""
        links = self.gripper.links
        widest_mm = max(links.shuttle_width_mm, links.finger_width_mm)
        if links.cross_bar_width_mm < _NARROW * widest_mm:
            return _MODE_ERROR_OF_NARROW, _GRIP_ERROR_OF_NARROW
        return _MODE_ERROR, _GRIP_ERROR

    def figures(self) -> ModelFigures:
        """Figures of the model for the comparison table."""
        return ModelFigures(
            gap_per_input(self.half),
            self.half.equilibrium(1.0).force_n,
            self.peak_stress(),
            self.modes_hz(drive_held=False),
            self.modes_hz(drive_held=True),
            contact_onset_mm(self.half, self.physics),
            self.swaying_modes_hz(),
            slope_error=_SLOPE_ERROR,
            force_error=_FORCE_ERROR,
            mode_error=self._joint_errors[0],
            grip_error=self._joint_errors[1],
        )


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> LumpedGripper:
    """Build the model; see `fingervision.models.kinds`."""
    return LumpedGripper(gripper, physics, theory)
