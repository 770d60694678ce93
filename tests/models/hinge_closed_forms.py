"""Closed formulas of the circular notch hinge from the literature, for comparison, each with its error.

Errors are those of the compliance against a plane-stress finite-element model with elastic end blocks, nu = 0.34;
negative means that the formula is too stiff. The models use `fingervision.models.hinge_correction` instead.
"""

from math import atan, pi, sqrt

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Material
from fingervision.models.hinge_correction import Notch


def circular_notch(radius_mm: float, thickness_mm: float, plate_mm: float) -> Notch:
    """A notch cut by two discs."""
    return Notch(thickness_mm, radius_mm, radius_mm, plate_mm)


def paros_weisbord_bending(notch: Notch, material: Material) -> float:
    """Rotation per moment about z in rad/(N mm), in full: Paros and Weisbord, Machine Design 37 (1965) 151.

    The formula is beam theory and valid for any t / R. Its error is -1.9 % at t / R = 0.05, -8.7 % at 0.25 and -20 % at
    0.8.
    """
    R, b = _radius_mm(notch), notch.plate_mm
    beta = notch.thickness_mm / (2.0 * R)
    B = 2.0 * beta + beta**2
    bracket = (
        1.0 / (1.0 + beta)
        + (3.0 + 2.0 * beta + beta**2) / ((1.0 + beta) * B)
        + 6.0 * (1.0 + beta) / (B * sqrt(B)) * atan(sqrt((2.0 + beta) / beta))
    )
    return 3.0 / (2.0 * material.youngs_modulus_mpa * b * R**2 * B) * bracket


def wu_zhou_bending(notch: Notch, material: Material) -> float:
    """Rotation per moment about z in rad/(N mm): Wu and Zhou (2002).

    The formula uses s = R / t. It equals the full formula of Paros and Weisbord, with the same error.
    """
    s = _radius_mm(notch) / notch.thickness_mm
    bracket = 2.0 * s**3 * (6.0 * s**2 + 4.0 * s + 1.0) / ((2.0 * s + 1.0) * (4.0 * s + 1.0) ** 2)
    bracket += 12.0 * s**4 * (2.0 * s + 1.0) / ((4.0 * s + 1.0) ** 2 * sqrt(4.0 * s + 1.0)) * atan(sqrt(4.0 * s + 1.0))
    return 12.0 * bracket / (material.youngs_modulus_mpa * notch.plate_mm * _radius_mm(notch) ** 2)


def wu_zhou_axial(notch: Notch, material: Material) -> float:
    """Elongation per axial force (mm/N), by a closed formula; errors as for the simplified formula."""
    s = _radius_mm(notch) / notch.thickness_mm
    integral = 2.0 * (2.0 * s + 1.0) / sqrt(4.0 * s + 1.0) * atan(sqrt(4.0 * s + 1.0)) - pi / 2.0
    return integral / (material.youngs_modulus_mpa * notch.plate_mm)


def _radius_mm(notch: Notch) -> float:
    if notch.half_length_mm != notch.depth_mm:
        raise FingervisionError(
            f"This closed form is that of a circular notch, but the half axes are {notch.half_length_mm:g} and "
            f"{notch.depth_mm:g} mm; take the compliance by quadrature."
        )
    return notch.half_length_mm
