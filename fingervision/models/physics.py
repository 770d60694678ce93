"""Options of a mechanical model for physics beyond small displacements."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Physics:
    """Options of a mechanical model; with all options off it is the linear model of Hricko & Havlik (2015).

    Parameters
    ----------
    large_rotation : bool
        Compute the equilibrium in the deformed shape. For the reference gripper this changes the gap by +0.3 % and the
        force by +6 % at a gap of 18 mm.
    contact : bool
        Prevent the fingers from passing through the symmetry plane.
    """

    large_rotation: bool = False
    contact: bool = False


LINEAR = Physics()
