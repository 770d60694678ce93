"""Largest input of a gripper before its hinges yield."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from fingervision.models.answer_figures import LoadedState, PeakStress
from fingervision.models.physics import Physics

_REFINEMENTS = 3
"""Secant steps: in the deformed shape the stress is nearly proportional to the input, so that three steps converge to
1e-4."""
_PLACES = 9


class StressedModel(Protocol):
    """Protocol of a model that computes the stress in its hinges."""

    physics: Physics

    def peak_stress(self) -> PeakStress:
        """Largest stress per 1 mm of input, small displacements."""
        ...

    def loaded(self, inputs_mm: Sequence[float]) -> list[LoadedState]:
        """Gap, forces and largest stress at the given inputs (mm)."""
        ...


def opening_at_yield_mm(model: StressedModel, yield_mpa: float) -> float:
    """Input, on the side where the fingers do not touch, at which the largest stress reaches yield (mm)."""
    travel_mm = yield_mpa / model.peak_stress().mpa_per_mm
    if model.physics.large_rotation:
        for _ in range(_REFINEMENTS):
            travel_mm *= yield_mpa / model.loaded([travel_mm])[0].stress_mpa
    return travel_mm


def input_at_yield_mm(model: StressedModel, end_mm: float, yield_mpa: float) -> float:
    """Input between zero and an end of the range at which the largest stress reaches the yield stress (mm)."""
    if not model.physics.large_rotation and not (model.physics.contact and end_mm < 0.0):
        return float(np.copysign(yield_mpa / model.peak_stress().mpa_per_mm, end_mm))
    inputs = np.linspace(0.0, end_mm, _PLACES)
    stress = np.array([0.0, *(state.stress_mpa for state in model.loaded(inputs[1:].tolist()))])
    return float(np.interp(yield_mpa, np.maximum.accumulate(stress), inputs))
