"""Gripping force on a part held between the fingers, for small displacements.

The part is a block with flat sides, of given width and stiffness, centred between the fingers. Each finger meets an
elastic plane at half the part's width. The plane is displaced by the finger's force divided by twice the part's
stiffness. The method is Signorini's contact problem, with the compliance of the part added to the compliance between
every pair of points on the finger's face.
"""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from fingervision.models.driven_body import DrivenBody, Equilibrium
from fingervision.models.signorini import contact_forces_n

Array = NDArray[np.float64]

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


def grip_equilibrium(body: DrivenBody, input_mm: float, part: Part) -> Equilibrium:
    """Compute the small displacements of the gripper with a part between the fingers.

    Parameters
    ----------
    body : DrivenBody
        The right half.
    input_mm : float
        Displacement of the drive.
    part : Part
        The part between the fingers.

    Returns
    -------
    Equilibrium
        Equilibrium of the right half; its contact forces are those of the part on each point of one finger's face, and
        their sum is the gripping force.
    """
    moved = input_mm * body.unit_displacement_mm
    free_gap = body.face_gap_mm(moved) - 0.5 * part.width_mm
    pressed = np.zeros(body.face.size)
    if free_gap.min() < 0.0:
        compliance = body.face_displacement_mm[body.face]
        yielding = 0.5 * (compliance + compliance.T) + 0.5 / part.stiffness_n_mm
        pressed = contact_forces_n(yielding, free_gap)
        moved = moved + body.face_displacement_mm @ pressed
    force_n = 2.0 * float((body.stiffness_n_mm @ moved)[body.driven].sum())
    return Equilibrium(input_mm, moved, force_n, pressed)


def first_grip_mm(body: DrivenBody, part: Part) -> float | None:
    """Input at which a finger first touches the part (mm); None if the fingers do not move towards it."""
    slope = body.unit_displacement_mm[body.face]
    closing = slope > 0.0
    if not closing.any():
        return None
    return float(np.max((0.5 * part.width_mm - body.face_rest_mm[closing]) / slope[closing]))


def mechanical_advantage(body: DrivenBody) -> float | None:
    """Increase of each finger's gripping force per increase of drive force, once the fingers touch each other.

    The part of the drive's work that does not increase the grip bends hinges and fingers. The function returns None for
    fingers that do not close.
    """
    touch = body.first_touch_mm()
    if touch is None:
        return None
    states = [body.equilibrium(touch * (1.0 + by), contact=True) for by in (0.0, _BEYOND_TOUCH)]
    grip = [float(state.contact_n.sum()) for state in states]
    return (grip[1] - grip[0]) / abs(states[1].force_n - states[0].force_n)
