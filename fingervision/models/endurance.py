"""Number of cycles that a flexure endures, from the S-N line of its material.

By Basquin's line, the logarithm of the stress amplitude falls linearly with the logarithm of the number of cycles.
Cycles about a mean stress are converted to fully reversed ones by Soderberg's line, amplitude / (1 - mean / yield)
(Shigley, Mechanical Engineering Design, chapter 6), which is more conservative than Goodman's line and needs only the
yield stress.
"""

from dataclasses import dataclass
from math import exp, log

from fingervision.domain.gripper import Material, SNLine


@dataclass(frozen=True, slots=True)
class Endurance:
    """Number of load cycles that a flexure endures.

    Parameters
    ----------
    amplitude_mpa, mean_mpa : float
        Amplitude and mean of the stress over a cycle.
    reversed_mpa : float
        Fully reversed amplitude that does the same damage; infinite where the cycle causes yielding.
    cycles : float or None
        Median life; None outside the range of the S-N line.
    at_least, at_most : float or None
        Bounds outside the range of the S-N line: more cycles than its last point, or fewer than its first.
    """

    amplitude_mpa: float
    mean_mpa: float
    reversed_mpa: float
    cycles: float | None
    at_least: float | None = None
    at_most: float | None = None

    @property
    def words(self) -> str:
        """Describe the endured number of cycles as text."""
        if self.cycles is not None:
            return f"about {self.cycles:.2g} cycles"
        if self.at_least is not None:
            return f"more than {self.at_least:.2g} cycles, where the S-N line ends"
        return f"fewer than {self.at_most:.2g} cycles, where the S-N line begins"


def endurance(material: Material, lowest_mpa: float, highest_mpa: float) -> Endurance | None:
    """Number of cycles endured if the stress alternates between two values, from the material's S-N line.

    Parameters
    ----------
    material : Material
        Material; None is returned for a material without an S-N line.
    lowest_mpa, highest_mpa : float
        Signed stress at the two ends of the cycle.
    """
    line = material.sn_line
    if line is None:
        return None
    amplitude, mean = 0.5 * (highest_mpa - lowest_mpa), 0.5 * abs(highest_mpa + lowest_mpa)
    reversed_mpa = _reversed(amplitude, mean, material.yield_mpa)
    first, last = (_reversed(a, _mean(a, line), material.yield_mpa) for a in line.amplitude_mpa)
    n_first, n_last = line.cycles
    if reversed_mpa > first:
        return Endurance(amplitude, mean, reversed_mpa, None, at_most=n_first)
    if reversed_mpa < last:
        return Endurance(amplitude, mean, reversed_mpa, None, at_least=n_last)
    share = log(first / reversed_mpa) / log(first / last)
    return Endurance(amplitude, mean, reversed_mpa, exp(log(n_first) + share * log(n_last / n_first)))


def _mean(amplitude_mpa: float, line: SNLine) -> float:
    return abs(amplitude_mpa * (1.0 + line.stress_ratio) / (1.0 - line.stress_ratio))


def _reversed(amplitude_mpa: float, mean_mpa: float, yield_mpa: float) -> float:
    return amplitude_mpa / (1.0 - mean_mpa / yield_mpa) if mean_mpa < yield_mpa else float("inf")
