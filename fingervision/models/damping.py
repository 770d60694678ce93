"""Damping of the gripper's vibrations: a constant ratio, Rayleigh damping, equation (4) of Hricko & Havlik (2015).

PA12 at room temperature has a loss factor tan d = 0.03 to 0.08, so that its damping ratio tan d / 2 is about 0.025;
static results do not depend on damping.
"""

from dataclasses import dataclass
from math import atan, cos, exp, isfinite, log, pi, sinh

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import ModelError, UsageError

Array = NDArray[np.float64]

_MOST = 0.3
_SINH_UNDERFLOWS_ABOVE = 30.0


@dataclass(frozen=True, slots=True)
class ModalDamping:
    """Damping law with the same damping ratio in every mode: at resonance, half the loss factor of the material."""

    ratio: float = 0.025

    def ratios(self, rad_s: Array) -> Array:
        """Damping ratio of each mode."""
        return checked(np.full_like(rad_s, self.ratio))


@dataclass(frozen=True, slots=True)
class RayleighDamping:
    """Rayleigh damping C = a M + b K: equal ratios at two frequencies, lower ratios between them, higher ones outside.

    Parameters
    ----------
    ratio : float
        Damping ratio at the two frequencies.
    low_rad_s, high_rad_s : float
        The two frequencies at which the ratio is reached.
    """

    ratio: float
    low_rad_s: float
    high_rad_s: float

    @property
    def mass_factor_per_s(self) -> float:
        """Factor of the mass matrix: 2 zeta w1 w2 / (w1 + w2), with damping ratio zeta at frequencies w1 and w2."""
        return 2.0 * self.ratio * self.low_rad_s * self.high_rad_s / (self.low_rad_s + self.high_rad_s)

    @property
    def stiffness_factor_s(self) -> float:
        """Factor of the stiffness matrix: 2 zeta / (w1 + w2), with damping ratio zeta at frequencies w1 and w2."""
        return 2.0 * self.ratio / (self.low_rad_s + self.high_rad_s)

    def ratios(self, rad_s: Array) -> Array:
        """Damping ratio of each mode."""
        return checked(0.5 * (self.mass_factor_per_s / rad_s + self.stiffness_factor_s * rad_s))


@dataclass(frozen=True, slots=True)
class PaperDamping:
    """Damping by equation (4) of Hricko & Havlik (2015), evaluated mode by mode.

    For a mode with angular frequency w, the damping ratio zeta follows from 2 zeta w = gamma w0 c(w / w0), with the
    rate c of `paper_rate`, the reference frequency w0 and a factor gamma. Equation (4) of Hricko & Havlik (2015) is an
    illustrative example of a theory (Adhikari, 2006, Journal of Sound and Vibration 293, 156), not a material law.
    Equation (4) adds powers of the angular frequency w that have different units, so that its result would depend on
    the unit of time; frequencies are therefore divided by a reference frequency w0. Below the reference frequency the
    damping would be negative, and at several times this frequency it would be more than critical. Therefore the
    reference frequency must not exceed that of the lowest mode, and damping ratios outside (0, 0.3) are refused.

    Parameters
    ----------
    reference_rad_s : float or None
        Reference frequency w0; None takes the lowest of the modes to be damped.
    gamma : float
        Dimensionless factor; zeta(w0) = 0.045 gamma.
    """

    reference_rad_s: float | None = None
    gamma: float = 0.5

    def ratios(self, rad_s: Array) -> Array:
        """Damping ratio of each mode.

        Raises
        ------
        ModelError
            If a mode lies below w0, or its damping ratio is outside (0, 0.3).
        """
        reference_rad_s = float(rad_s.min()) if self.reference_rad_s is None else self.reference_rad_s
        relative = rad_s / reference_rad_s
        if np.any(relative < 1.0 - 1e-9):
            raise ModelError(
                f"The paper's damping, equation (4), is negative below its reference frequency, {reference_rad_s:g} "
                f"rad/s, but the lowest mode is at {rad_s.min():g} rad/s; lower the reference to that frequency."
            )
        return checked(np.array([0.5 * self.gamma * paper_rate(w) / w for w in relative.tolist()]))


def paper_rate(w: float) -> float:
    """Equation (4) for one mode: 2 zeta w as a function of the dimensionless frequency w, with zeta the damping ratio.

    At the angular frequency w, the rate is exp(-w^4 / 2) sinh((4/3) ln(w) / w^2) + w^(3/2) cos^2(1 / w^2) atan(w / pi).
    For a single mode, the argument sqrt(M^-1 K) / pi in the paper becomes w / pi.
    """
    first = 0.0 if w**4 > 2.0 * _SINH_UNDERFLOWS_ABOVE else exp(-(w**4) / 2.0) * sinh(4.0 / 3.0 * log(w) / w**2)
    return first + float(w**1.5) * cos(1.0 / w**2) ** 2 * atan(w / pi)


def checked(ratios: Array) -> Array:
    """Return damping ratios unchanged if a solid can have them (between 0 and 0.3); refuse others.

    Raises
    ------
    ModelError
        If a damping ratio is outside this range.
    """
    if np.any(ratios <= 0.0) or np.any(ratios >= _MOST):
        worst = ratios[np.argmax(np.abs(ratios))]
        raise ModelError(f"Damping ratios must lie between 0 and {_MOST:g}, but one is {worst:.3g}; use fewer modes.")
    return ratios


Damping = ModalDamping | RayleighDamping | PaperDamping


# Parse the short text of a damping law that is given to `model --damping`.

FORMS = "modal:0.025, loss:0.05, rayleigh:0.025:45:360 (ratio and two frequencies in Hz) or paper[:0.5]"


def parse_damping(text: str) -> Damping:
    """Parse a damping law.

    Parameters
    ----------
    text : str
        `modal:RATIO`, `loss:FACTOR` (twice the ratio), `rayleigh:RATIO:HZ:HZ`, `paper` or `paper:GAMMA`: equation (4)
        of Hricko & Havlik (2015) relative to the lowest vibrating mode.

    Raises
    ------
    UsageError
        If the text has none of these forms, or its damping ratio is not possible for a solid.
    """
    law, *parts = text.split(":")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = [float("nan")]
    counts = {"modal": (1,), "loss": (1,), "rayleigh": (3,), "paper": (0, 1)}
    if len(numbers) not in counts.get(law, ()) or not all(isfinite(x) and x > 0.0 for x in numbers):
        raise UsageError(f"--damping must be {FORMS}, with positive numbers, but is {text}.")
    if law == "paper":
        return PaperDamping(None, *numbers)
    ratio = 0.5 * numbers[0] if law == "loss" else numbers[0]
    if ratio >= _MOST:
        raise UsageError(
            f"--damping must give a damping ratio below {_MOST:g}, which no solid exceeds, but {text} gives {ratio:g}."
        )
    if law != "rayleigh":
        return ModalDamping(ratio)
    if not numbers[1] < numbers[2]:
        raise UsageError(f"--damping rayleigh must have two frequencies in Hz, the lower one first, but is {text}.")
    return RayleighDamping(ratio, 2.0 * pi * numbers[1], 2.0 * pi * numbers[2])
