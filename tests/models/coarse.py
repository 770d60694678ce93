"""Finite elements of a mesh that is as coarse as tests of per cents allow, at half the time of the product's own."""

from fingervision.models.finite_element import MechanismPlate
from fingervision.models.mechanism import Mechanism


def coarse_elements(mechanism: Mechanism, *, width_effect: bool = True, refine: float = 0.4) -> MechanismPlate:
    return MechanismPlate(mechanism, width_effect=width_effect, refine=refine)
