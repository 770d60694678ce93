"""Test whether a measured object agrees with its certificate."""

from dataclasses import dataclass
from math import hypot

# Coverage factor of expanded uncertainties, for a coverage of about 95 % (JCGM 100:2008, 6.2).
COVERAGE_FACTOR = 2.0


@dataclass(frozen=True, slots=True)
class Agreement:
    """Comparison of a measurement with a certified value.

    Parameters
    ----------
    measured_mm, u_measured_mm : float
        Measured value, with its standard uncertainty.
    certified_mm, u_certified_mm : float
        Certified value, with its standard uncertainty.
    """

    measured_mm: float
    u_measured_mm: float
    certified_mm: float
    u_certified_mm: float

    @property
    def deviation_mm(self) -> float:
        """Measured value minus certified value."""
        return self.measured_mm - self.certified_mm

    @property
    def e_n(self) -> float:
        """Ratio `E_n` of deviation to expanded uncertainty (ISO 13528:2022); a magnitude of at most 1 is agreement."""
        expanded = COVERAGE_FACTOR * hypot(self.u_measured_mm, self.u_certified_mm)
        return self.deviation_mm / expanded if expanded > 0.0 else float("inf")

    @property
    def agrees(self) -> bool:
        """Whether the deviation lies within its expanded uncertainty."""
        return abs(self.e_n) <= 1.0
