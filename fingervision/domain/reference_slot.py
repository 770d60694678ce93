"""A reference slot: an opening of known width in the fingers' plane, measured through the same camera and scale."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReferenceSlot:
    """One reference slot with its true and its measured width.

    Parameters
    ----------
    size_mm, u_size_mm : float
        True width of the slot, and its standard uncertainty.
    measured_mm, u_random_mm : float
        Width measured in the pictures, and its random standard uncertainty.
    """

    size_mm: float
    u_size_mm: float
    measured_mm: float
    u_random_mm: float
