"""Gripping force on a part held between the fingers, for small displacements.

The part is a block with flat sides, of given width and stiffness, centred between the fingers. Each finger meets an
elastic plane at half the part's width. The plane is displaced by the finger's force divided by twice the part's
stiffness. The method is Signorini's contact problem, with the compliance of the part added to the compliance between
every pair of points on the finger's face.
"""

from dataclasses import dataclass
from math import inf

from fingervision.models.answer_figures import LoadedState
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.mechanism_equilibrium import MechanismEquilibrium

_BEYOND_TOUCH = 0.05
"""Step beyond the input of first touch, as a share of that input: large beside rounding errors, and so small that no
further point touches."""


@dataclass(frozen=True, slots=True)
class Part:
    """A part to be gripped between the fingers.

    Parameters
    ----------
    width_mm : float
        Width of the part without load.
    stiffness_n_mm : float
        Squeezing force per loss of width; infinite for a rigid part.
    """

    width_mm: float
    stiffness_n_mm: float = inf

    def squeezed_mm(self, grip_n: float) -> float:
        """Width of the part under a gripping force (mm)."""
        return self.width_mm - grip_n / self.stiffness_n_mm


def grip_equilibrium(model: DrawnGripper, input_mm: float, part: Part) -> MechanismEquilibrium:
    """Compute the small displacements of the gripper with a part between the fingers.

    Parameters
    ----------
    model : DrawnGripper
        The gripper.
    input_mm : float
        Displacement of the drive.
    part : Part
        The part between the fingers.
    """
    yielding_mm_n = 0.5 / part.stiffness_n_mm / model.elastic.mechanism.halves
    return model.elastic.driven.equilibrium(input_mm, contact=True, between=(0.5 * part.width_mm, yielding_mm_n))


def gripped(model: DrawnGripper, input_mm: float, part: Part) -> LoadedState:
    """Gap, forces and stress with a part between the fingers; the grip is the force of one finger."""
    return model.stressed(input_mm, grip_equilibrium(model, input_mm, part))


def first_grip_mm(model: DrawnGripper, part: Part) -> float | None:
    """Input at which a finger first touches the part (mm); None if the fingers do not move towards it."""
    return model.reaches_mm(0.5 * part.width_mm)


def mechanical_advantage(model: DrawnGripper) -> float | None:
    """Increase of each finger's gripping force per increase of drive force, once the fingers touch each other.

    The part of the drive's work that does not increase the grip bends hinges and fingers. The function returns None for
    fingers that do not close.
    """
    touch = model.first_touch_mm
    if touch is None:
        return None
    driven = model.elastic.driven
    states = [driven.equilibrium(touch * (1.0 + by), contact=True) for by in (0.0, _BEYOND_TOUCH)]
    grip = [float(state.pressed_n[0].sum()) / model.elastic.mechanism.halves for state in states]
    return (grip[1] - grip[0]) / abs(states[1].force_n - states[0].force_n)
