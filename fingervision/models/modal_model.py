"""A driven elastic body reduced to its static shape and its natural modes: the basis of all dynamic responses.

The motion u(t) of the drive is prescribed. The body follows u by its static shape s; each mode r of the body with fixed
drive is excited by the inertia of the static shape (Craig and Bampton, 1968, AIAA Journal 6, 1313, with one interface
unknown):

    q_r'' + 2 zeta_r w_r q_r' + w_r^2 q_r = -L_r u''
    force at the drive = k u + m u'' + sum_r L_r q_r''

with L_r = phi_r' M s, k = s' K s and m = s' M s, where mode r has the coordinate q_r, the shape phi_r, the angular
frequency w_r and the damping ratio zeta_r, and the body has the mass matrix M and the stiffness matrix K. Damping acts
on the motion relative to the static shape. If the drive is free to move and pushed by a force f, the modes with free
drive vibrate instead; with d_r the motion of the drive in mode r:

    q_r'' + 2 zeta_r w_r q_r' + w_r^2 q_r = d_r f
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.models.damping import Damping

Array = NDArray[np.float64]

GAP = "gap_mm"


@dataclass(frozen=True, slots=True, eq=False)
class Observable:
    """An output of a mechanism: a gap, or a component of a probe's displacement.

    Parameters
    ----------
    rest_mm : float
        Value at zero input.
    per_input : float
        Change of the static value per 1 mm of input.
    by_mode : ndarray of float, shape (modes,)
        Change per unit of each mode's coordinate.
    """

    rest_mm: float
    per_input: float
    by_mode: Array


@dataclass(frozen=True, slots=True, eq=False)
class ModalModel:
    """A mechanism reduced to its static shape and its modes with the drive held.

    Parameters
    ----------
    stiffness_n_mm, mass_t : float
        Stiffness k and mass m of the static shape for 1 mm of input.
    rad_s, participation : ndarray of float, shape (modes,)
        Angular frequencies of the modes with the drive held, in rising order, and the participation factors L of the
        modes, normalised to unit modal mass.
    observed : mapping of str to Observable
        Computed outputs by the name of their column.
    """

    stiffness_n_mm: float
    mass_t: float
    rad_s: Array
    participation: Array
    observed: Mapping[str, Observable]

    @property
    def modes_hz(self) -> Array:
        """Natural frequencies with the drive held."""
        return self.rad_s / (2.0 * pi)

    def with_modes(self, count: int) -> "ModalModel":
        """Keep the first modes only; the contribution of the remaining modes then follows the drive without delay."""
        observed = {name: replace(seen, by_mode=seen.by_mode[:count]) for name, seen in self.observed.items()}
        return replace(self, rad_s=self.rad_s[:count], participation=self.participation[:count], observed=observed)

    def damped(self, damping: Damping) -> tuple["ModalModel", Array]:
        """Keep the modes for which a damping law is valid, with their damping ratios; see `described`."""
        ratios = described(damping, self.rad_s)
        return self.with_modes(ratios.size), ratios


@dataclass(frozen=True, slots=True, eq=False)
class FreeModes:
    """Vibration modes with the drive free to move along its direction.

    Parameters
    ----------
    rad_s, drive : ndarray of float, shape (modes,)
        Angular frequencies in rising order, and the drive's motion in each mode, normalised to unit modal mass.
    by_mode : mapping of str to ndarray of float, shape (modes,)
        Change of each observed length per unit of each mode's coordinate.
    """

    rad_s: Array
    drive: Array
    by_mode: Mapping[str, Array]


def described(damping: Damping, rad_s: Array) -> Array:
    """Damping ratios of the lowest modes, as far as a damping law is valid for them.

    A damping law may give ratios that are impossible for solids, as equation (4) of Hricko & Havlik (2015) does at a
    few times its reference frequency. A damping law is used only for the modes below the frequency at which its ratios
    become impossible.

    Raises
    ------
    FingervisionError
        If the law is not valid for the lowest mode.
    """
    for count in range(rad_s.size, 1, -1):
        try:
            return damping.ratios(rad_s[:count])
        except FingervisionError:
            continue
    return damping.ratios(rad_s[:1])
