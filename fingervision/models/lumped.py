"""The gripper as a chain of lumped flexures and elastic links, as in the SimMechanics model of Hricko & Havlik (2015).

Each notch is divided into segments, which are shorter near the neck. The compliance of each segment is the integral
over its length, so that the segments together have the notch's compliance up to rounding, however thin the notch is.
The remaining error is that of beam theory, which the hinge correction removes. The finger between the hinges is one
elastic body (`finger_body`).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.domain.response import Response
from fingervision.models.answer_figures import LoadedState, ModelFigures, PeakStress
from fingervision.models.covered_inputs import covered_inputs_mm
from fingervision.models.driven_body import Equilibrium
from fingervision.models.finger_body import finger_ends_mm
from fingervision.models.gripper_bodies import gripper_poses, poses_of_frame
from fingervision.models.half_frame import frame_of, half_frame, joined_frame_of
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.hinge_stress import peak_hinge_stress, peak_in_deformed_shape
from fingervision.models.joined_frame import JoinedFrame
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.skeleton import skeleton_of
from fingervision.models.static_answer import (
    contact_onset_mm,
    equilibria,
    gap_per_input,
    loaded_state,
    symmetric_response,
)
from fingervision.models.width_effect import force_uncertainty

KIND = "lumped"
TRUST, WHY_TRUSTED = 2, "both models replace the body by bars, and the lumped model has more bars"

_SEGMENTS = 10
_MODES = 3
_SLOPE_ERROR, _FORCE_ERROR, _MODE_ERROR, _GRIP_ERROR = 0.002, 0.015, 0.02, 0.015
"""Relative model errors, from finite elements of other grippers: slope within 0.03 %, force 0.9 %, first modes 0.4 %
(`tests/benchmarks/models_held_out.py`), grip on a part 0.5 % (`models_grip.py`)."""
_SLOPE_OF_BARS, _FORCE_OF_BARS, _MODE_OF_BARS, _GRIP_OF_BARS = 0.01, 0.03, 0.2, 0.35
"""Relative model errors with a finger made of bars only: bars bend up to the point where their axes meet, whereas the
real body does not. This hardly affects slope and force, but the grip and the first mode are 31 % and 18 % off where the
cross bar is 5 mm wide between bars of 9 mm."""


class LumpedGripper:
    """Lumped model of a gripper: hinge segments, and elastic links of two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included.
    theory : HingeTheory
        Theory of the hinges' compliance.
    segments : int
        Segments per notch; n in Hricko & Havlik (2015).
    block : ndarray of float, shape (3, 3), or None
        Result of `drive_block_root.unit_compliance` for the drive block, if already computed.
    bars_alone : bool
        Whether the finger too is modelled by bars joined at points, which takes a hundredth of the time; with beam
        theory, the finger is always modelled by bars.
    """

    name = KIND

    def __init__(
        self,
        gripper: Gripper,
        physics: Physics = LINEAR,
        theory: HingeTheory = HingeTheory.CORRECTED,
        segments: int = _SEGMENTS,
        block: NDArray[np.float64] | None = None,
        *,
        bars_alone: bool = False,
    ) -> None:
        self.gripper = gripper
        self.physics = physics
        self.theory = theory
        bars_alone = bars_alone or theory is HingeTheory.BEAM
        ends_mm = None if bars_alone else finger_ends_mm(gripper)
        self.skeleton = skeleton_of(gripper, theory, segments, block=block, ends_mm=ends_mm)
        self.frame = (frame_of if bars_alone else joined_frame_of)(gripper, self.skeleton)
        self.half = half_frame(gripper, self.skeleton, self.frame)

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input for which the model is valid (mm)."""
        return covered_inputs_mm(self.gripper, self.half.first_touch_mm())

    @property
    def rest_gap_mm(self) -> float:
        """The gap at zero input (mm)."""
        return 2.0 * self.half.measured_rest_mm

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """Compute the static response at each input."""
        return symmetric_response(self.half, self.physics, input_mm)

    def body_poses(self, input_mm: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Poses of the bodies at each input: x_mm, y_mm, angle_mrad, shape (n, 3) each."""
        poses = poses_of_frame(self.gripper, self.skeleton, large=self.physics.large_rotation)
        return gripper_poses(self.half, self.physics, poses, input_mm)

    def peak_stress(self) -> PeakStress:
        """Largest stress in the hinges per 1 mm of input: on the notch surface, or nominal with beam theory."""
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
    def _errors(self) -> tuple[float, float, float, float]:
        """Relative model errors of slope, force, modes and grip; larger with beam theory (finger made of bars)."""
        if not isinstance(self.frame, JoinedFrame):
            return _SLOPE_OF_BARS, _FORCE_OF_BARS, _MODE_OF_BARS, _GRIP_OF_BARS
        force = _FORCE_ERROR + 2.0 * force_uncertainty(self.gripper.material)
        return _SLOPE_ERROR, force, _MODE_ERROR, _GRIP_ERROR

    def figures(self) -> ModelFigures:
        """Characteristic numbers of the model for the comparison table."""
        slope, force, mode, grip = self._errors
        return ModelFigures(
            gap_per_input(self.half),
            self.half.equilibrium(1.0).force_n,
            self.peak_stress(),
            self.modes_hz(drive_held=False),
            self.modes_hz(drive_held=True),
            contact_onset_mm(self.half, self.physics),
            self.swaying_modes_hz(),
            slope_error=slope,
            force_error=force,
            mode_error=mode,
            grip_error=grip,
        )


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> LumpedGripper:
    """Build the model; see `fingervision.models.kinds`."""
    return LumpedGripper(gripper, physics, theory)
