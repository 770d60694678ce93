"""Compliance of a notch hinge: beam theory integrated along the notch, in all six directions.

The load acts at the right end of the notch, x = R; the left end is fixed. The components are ordered as displacements
along x, y, z, then rotations about x, y, z, with x along the hinge, y across the hinge in the plane, and z out of the
plane. For circular notches, Paros and Weisbord (1965) and Wu and Zhou (2002, Review of Scientific Instruments 73, 3101)
give closed formulas, which the quadrature reproduces to ten digits. Beam theory is too stiff, and more so for thicker
hinges: compared with a finite-element model at t / R = 0.25, by 5 % in bending and 7 % in tension; in torsion it is 28
% too soft. `corrected_compliance` corrects these errors.
"""

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from fingervision.domain.gripper import Material
from fingervision.models.notch import Notch

Array = NDArray[np.float64]

_GAUSS = leggauss(160)
"""Gauss-Legendre points and weights: accurate to thirteen digits from t / R = 0.002 to 1."""
_SHEAR = 6.0 / 5.0
"""Shear factor of a rectangle: Timoshenko, Strength of Materials, part 1."""


def beam_compliance(notch: Notch, material: Material, span_mm: tuple[float, float] | None = None) -> Array:
    """Integrate the compliance of a notch by beam theory, including shear and Saint-Venant torsion.

    Parameters
    ----------
    notch : Notch
        Shape of the notch.
    material : Material
        Linear elastic material.
    span_mm : (float, float) or None
        Start and end of a part of the notch, as positions along its axis from its middle; the load acts at the part's
        right end. The parts in series have the compliance of the whole notch to rounding, wherever the notch is
        divided. None for the whole notch.

    Returns
    -------
    ndarray of float, shape (6, 6)
        Symmetric matrix with entries in mm/N, rad/N = mm/(N mm) and rad/(N mm).
    """
    # With x = a sin(angle) the integrands are smooth at the notch's ends; with sin(angle / 2) = c sinh(s) the peak of 1
    # / h^3 at the neck, which is sqrt(t R) wide, becomes as wide as the range, so that no digits are lost for thin
    # necks.
    nodes, weights = _GAUSS
    a, b = notch.half_length_mm, notch.plate_mm
    c = notch.bending_share
    low, high = (np.arcsin(np.clip(end / a, -1.0, 1.0)) for end in span_mm or (-notch.reach_mm, notch.reach_mm))
    s_low, s_high = np.arcsinh(np.sin(low / 2.0) / c), np.arcsinh(np.sin(high / 2.0) / c)
    s = 0.5 * (s_high + s_low) + 0.5 * (s_high - s_low) * nodes
    angle = 2.0 * np.arcsin(c * np.sinh(s))
    d_angle = 2.0 * c * np.cosh(s) / np.cos(angle / 2.0)
    x = a * np.sin(angle)
    dx = weights * 0.5 * (s_high - s_low) * d_angle * a * np.cos(angle)
    h = notch.height_mm(x)
    E, G = material.youngs_modulus_mpa, material.shear_modulus_mpa
    arm = a * np.sin(high) - x
    return _assemble(
        along=float(np.sum(dx / (E * b * h))),
        shear=float(_SHEAR * np.sum(dx / (G * b * h))),
        about_z=[float(np.sum(dx * arm**k * 12.0 / (E * b * h**3))) for k in range(3)],
        about_y=[float(np.sum(dx * arm**k * 12.0 / (E * b**3 * h))) for k in range(3)],
        twist=float(np.sum(dx / (G * torsion_constant_mm4(h, b)))),
    )


def bar_compliance(length_mm: float, width_mm: float, plate_mm: float, material: Material) -> Array:
    """Compliance of a straight bar (Timoshenko beam) at its loaded end, with the other end fixed.

    The order of components and the units are the same as in `beam_compliance`.
    """
    E, G = material.youngs_modulus_mpa, material.shear_modulus_mpa
    area = width_mm * plate_mm
    powers = [length_mm ** (k + 1) / (k + 1) for k in range(3)]
    return _assemble(
        along=length_mm / (E * area),
        shear=_SHEAR * length_mm / (G * area),
        about_z=[12.0 * p / (E * plate_mm * width_mm**3) for p in powers],
        about_y=[12.0 * p / (E * plate_mm**3 * width_mm) for p in powers],
        twist=float(length_mm / (G * torsion_constant_mm4(np.array(width_mm), plate_mm))),
    )


def torsion_constant_mm4(height_mm: Array, plate_mm: float) -> Array:
    """Saint-Venant torsion constant of a rectangle.

    J = p q^3 (1/3 - 0.21 q/p (1 - q^4 / (12 p^4))), with p the longer and q the shorter side: Young and Budynas,
    Roark's Formulas for Stress and Strain, table 10.1.
    """
    p, q = np.maximum(height_mm, plate_mm), np.minimum(height_mm, plate_mm)
    return np.asarray(p * q**3 * (1.0 / 3.0 - 0.21 * q / p * (1.0 - q**4 / (12.0 * p**4))))


def _assemble(along: float, shear: float, about_z: list[float], about_y: list[float], twist: float) -> Array:
    C = np.zeros((6, 6))
    C[0, 0] = along
    C[1, 1] = about_z[2] + shear
    C[1, 5] = C[5, 1] = about_z[1]
    C[5, 5] = about_z[0]
    C[2, 2] = about_y[2] + shear
    C[2, 4] = C[4, 2] = -about_y[1]
    C[4, 4] = about_y[0]
    C[3, 3] = twist
    return C
