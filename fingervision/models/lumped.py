"""The gripper as lumped flexures between elastic bodies, after the SimMechanics model of Hricko & Havlik (2015)."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.models.bars import SEGMENTS, BarFrame
from fingervision.models.elastic_mechanism import ElasticMechanism
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.gripper_model import DrawnGripper, ModelErrors
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.mechanism_frame import MechanismFrame
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.width_effect import force_uncertainty

KIND = "lumped"
TRUST, WHY_TRUSTED = 2, "both models replace the hinges by beams, and the lumped model has elastic bodies between them"

_ERRORS = ModelErrors(0.002, 0.015, 0.02, 0.015)
"""Relative model errors, from finite elements of other grippers: slope within 0.03 %, force 0.9 %, first modes 0.4 %
(`tests/benchmarks/models_held_out.py`), grip on a part 0.5 % (`models_grip.py`)."""
_ERRORS_OF_BARS = ModelErrors(0.01, 0.03, 0.2, 0.35)
"""Relative model errors with bars only, and of beam theory: bars bend up to the point where their axes meet, unlike the
real body. Slope and force are hardly affected, but the grip and the first mode are 31 % and 18 % off where the cross
bar is 5 mm wide between bars of 9 mm."""


class LumpedGripper(DrawnGripper):
    """Lumped model of a gripper: hinge segments between the bodies of two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included.
    theory : HingeTheory
        Theory of the hinges' compliance.
    block : ndarray of float, shape (3, 3), or None
        With `bars_alone`, result of `drive_block_root.unit_compliance` for the drive block, if already computed.
    bars_alone : bool
        Whether the bodies are modelled by bars joined at points, which takes a hundredth of the time.
    segments : int
        With `bars_alone`, segments per notch; n in Hricko & Havlik (2015).
    """

    name = KIND

    def __init__(
        self,
        gripper: Gripper,
        physics: Physics = LINEAR,
        theory: HingeTheory = HingeTheory.CORRECTED,
        *,
        block: NDArray[np.float64] | None = None,
        bars_alone: bool = False,
        segments: int = SEGMENTS,
    ) -> None:
        elastic: ElasticMechanism
        if bars_alone:
            elastic, errors = BarFrame(gripper, theory, segments, block=block), _ERRORS_OF_BARS
        else:
            elastic = MechanismFrame(half_mechanism(gripper), theory=theory)
            force = _ERRORS.force + 2.0 * force_uncertainty(gripper.material)
            errors = ModelErrors(_ERRORS.slope, force, _ERRORS.mode, _ERRORS.grip)
            if theory is HingeTheory.BEAM:
                errors = _ERRORS_OF_BARS
        super().__init__(gripper, physics, elastic, errors)


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> LumpedGripper:
    """Build the model; see `fingervision.models.kinds`."""
    return LumpedGripper(gripper, physics, theory)
