"""All characteristic numbers of one model by name: at zero input, at the ends of a range of inputs, and limits."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import copysign, exp, isfinite, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper, Material, SNLine
from fingervision.models.answer_figures import LoadedState, ModelFigures, PeakStress
from fingervision.models.elastic_mechanism import MechanismState
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.grip import mechanical_advantage
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.mechanism_figures import per_kelvin

# Largest input of a gripper before its hinges yield.

_REFINEMENTS = 3
"""Secant steps: in the deformed shape the stress is nearly proportional to the input, so that three steps converge to
1e-4."""
_PLACES = 9


def opening_at_yield_mm(model: DrawnGripper, yield_mpa: float) -> float:
    """Input, on the side where the fingers do not touch, at which the largest stress reaches yield (mm)."""
    travel_mm = float(yield_mpa / model.peak_stress().mpa_per_mm)
    for _ in range(_REFINEMENTS if model.physics.large_rotation else 0):
        travel_mm *= yield_mpa / model.loaded([travel_mm])[0].stress_mpa
    return travel_mm


def input_at_yield_mm(model: DrawnGripper, end_mm: float, yield_mpa: float) -> float:
    """Input between zero and an end of the range at which the largest stress reaches the yield stress (mm)."""
    if not model.physics.large_rotation and not (model.physics.contact and end_mm < 0.0):
        return float(np.copysign(yield_mpa / model.peak_stress().mpa_per_mm, end_mm))
    inputs = np.linspace(0.0, end_mm, _PLACES)
    stress = np.array([0.0, *(state.stress_mpa for state in model.loaded(inputs[1:].tolist()))])
    return float(np.interp(yield_mpa, np.maximum.accumulate(stress), inputs))


# Number of cycles that a flexure endures, from the S-N line of its material.
#
# By Basquin's line, the logarithm of the stress amplitude falls linearly with the logarithm of the number of cycles.
# Cycles about a mean stress are converted to fully reversed ones by Soderberg's line, amplitude / (1 - mean / yield)
# (Shigley, Mechanical Engineering Design, chapter 6), which is more conservative than Goodman's line and needs only
# the yield stress.


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


# Characteristic numbers of a gripper in operation: leverage, parasitic motion, effects of weight and temperature.

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class OperatingFigures:
    """Characteristic numbers of one gripper in operation, for small displacements.

    Parameters
    ----------
    mechanical_advantage : float or None
        Increase of each finger's gripping force per drive force, N/N, once the fingers touch.
    tip_along_per_input : float
        Parasitic motion of the measuring point along the fingers per 1 mm of input, mm/mm.
    tip_turn_deg_per_mm : float
        Parasitic rotation of the tip's inner face per 1 mm of input; a positive value rotates the right finger's tip
        outwards, so that the gap opens more at the top.
    gap_by_weight_mm, midline_by_weight_mm : float
        Change under one standard gravity of the gap (plate upright) and of the midline (plate on its side).
    gap_per_kelvin_mm, force_per_kelvin_n : float or None
        Change of the gap and of the force at the held drive per kelvin; None if the material states no thermal
        expansion.
    """

    mechanical_advantage: float | None
    tip_along_per_input: float
    tip_turn_deg_per_mm: float
    gap_by_weight_mm: float
    midline_by_weight_mm: float
    gap_per_kelvin_mm: float | None
    force_per_kelvin_n: float | None


def operating_figures(model: DrawnGripper) -> OperatingFigures:
    """Compute the characteristic numbers of a gripper in operation."""
    elastic = model.elastic
    moved = elastic.driven.unit_displacement
    y_mm = elastic.contact_points_mm[0][1]
    lean = float(np.polyfit(y_mm - y_mm.mean(), model.face_per_input, 1)[0])
    # A frame of bars or beams cannot give thermal expansion: its bars end where their axes meet, and the error exceeds
    # the sample's change.
    warmed = per_kelvin(elastic) if isinstance(elastic, MechanismPlate) else None
    return OperatingFigures(
        mechanical_advantage=mechanical_advantage(model),
        tip_along_per_input=float(elastic.motion_mm(moved, model.gripper.measuring_point_mm, large=False)[1]),
        tip_turn_deg_per_mm=float(np.degrees(lean)),
        gap_by_weight_mm=model.gap_change_mm(elastic.under_weight((0.0, -1.0))),
        midline_by_weight_mm=model.midline_by_weight_mm(),
        gap_per_kelvin_mm=None if warmed is None else model.gap_change_mm(warmed[0]),
        force_per_kelvin_n=None if warmed is None else warmed[1],
    )


_UNITS = {
    "gap_per_input": "mm/mm",
    "input_stiffness_n_mm": "N/mm",
    "peak_stress_mpa_per_mm": "MPa/mm",
    "mechanical_advantage": "N/N",
    "tip_along_per_input": "mm/mm",
    "tip_turn_deg_per_mm": "degrees/mm",
    "gap_per_kelvin_mm": "mm/K",
    "force_per_kelvin_n": "N/K",
    "endurance_cycles": "cycles",
    "seconds": "s",
}
_ENDS: Mapping[str, str] = {"_mm": "mm", "_hz": "Hz", "_n": "N", "_mpa": "MPa", "_percent": "%"}


_RANGE_ENDS, _LOADS = ("lowest", "highest"), ("input_mm", "gap_mm", "force_n", "grip_n", "stress_mpa")
_COLUMNS = (
    "gap_per_input", "input_stiffness_n_mm", "peak_stress_mpa_per_mm", "peak_x_mm", "peak_y_mm", "input_at_yield_mm",
    "first_mode_drive_free_hz", "first_mode_drive_held_hz", "first_swaying_mode_hz", "first_out_of_plane_mode_hz",
    "contact_input_mm", "gap_at_yield_mm", *(field.name for field in fields(OperatingFigures)), "sag_out_of_plane_mm",
    *(f"{end}_{name}" for end in _RANGE_ENDS for name in _LOADS), "endurance_cycles",
    *(f"model_error_{of}_percent" for of in ("slope", "force", "modes", "out_of_plane", "grip", "sag")),
)  # fmt: skip
"""Columns of models.csv, in order; those that a kind of model cannot compute stay empty."""


def gripper_figures(
    gripper: Gripper, model: Any, inputs: Sequence[float] | NDArray[np.float64], figures: ModelFigures | None = None
) -> dict[str, float | None]:
    """Column of `models.csv` for one model: numbers at zero input, and loads at both ends of a range of inputs.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    model : StiffnessMatrixGripper, LumpedGripper or FiniteElementGripper
        Model of that drawing, with its physics.
    inputs : sequence of float
        Inputs whose smallest and largest value are the ends of the range; the endurance is for a cycle between these
        ends.
    figures : ModelFigures or None
        Result of `model.figures()`, if already computed.

    Returns
    -------
    dict of str to float or None
        Numbers by name; the unit ends the name (`unit_of`). None for a number that the model cannot compute.
    """
    figures = figures or model.figures()
    row: dict[str, float | None] = dict.fromkeys(_COLUMNS)
    row |= {
        "gap_per_input": figures.gap_per_input,
        "input_stiffness_n_mm": figures.input_stiffness_n_mm,
        "first_mode_drive_free_hz": next(iter(figures.free_modes_hz), None),
        "first_mode_drive_held_hz": next(iter(figures.locked_modes_hz), None),
        "first_swaying_mode_hz": next(iter(figures.swaying_modes_hz), None),
        "first_out_of_plane_mode_hz": next(iter(figures.out_of_plane_modes_hz), None),
        "contact_input_mm": figures.contact_input_mm,
        "sag_out_of_plane_mm": figures.sag_out_of_plane_mm,
        "model_error_slope_percent": 100.0 * figures.slope_error,
        "model_error_force_percent": 100.0 * figures.force_error,
    }
    if isinstance(model, DrawnGripper):
        row |= asdict(operating_figures(model))
    ends = [float(min(inputs)), float(max(inputs))]
    if figures.peak_stress is None:
        answer = model.respond(np.array(ends))
        forces = (None, None) if answer.force_n is None else answer.force_n.tolist()
        for end, *load in zip(_RANGE_ENDS, ends, answer.gap_mm.tolist(), forces, strict=True):
            row |= {f"{end}_{name}": value for name, value in zip(_LOADS, load, strict=False)}
    else:
        row |= _stressed(gripper.material, model, figures.peak_stress, ends)
        row["model_error_grip_percent"] = 100.0 * figures.grip_error
    if figures.free_modes_hz:
        row["model_error_modes_percent"] = 100.0 * figures.mode_error
    if figures.out_of_plane_modes_hz:
        row["model_error_out_of_plane_percent"] = 100.0 * figures.out_of_plane_error
    if figures.sag_out_of_plane_mm is not None:
        row["model_error_sag_percent"] = 100.0 * figures.sag_error
    return row


def _stressed(
    material: Material, model: DrawnGripper, peak: PeakStress, ends: Sequence[float]
) -> dict[str, float | None]:
    """Numbers that follow from the stress, and the loads at both ends of a range of inputs."""
    at_yield, states = opening_at_yield_mm(model, material.yield_mpa), model.loaded(ends)
    row: dict[str, float | None] = {
        "peak_stress_mpa_per_mm": peak.mpa_per_mm,
        "peak_x_mm": peak.place_mm[0],
        "peak_y_mm": peak.place_mm[1],
        "input_at_yield_mm": at_yield,
        "gap_at_yield_mm": model.loaded([at_yield])[0].gap_mm,
    }
    for end, state in zip(_RANGE_ENDS, states, strict=True):
        row |= {f"{end}_{name}": getattr(state, name) for name in _LOADS}
    if (life := life_over(material, states)) is not None:
        row["endurance_cycles"] = life.cycles
    return row


def life_over(material: Material, states: Sequence[LoadedState | MechanismState]) -> Endurance | None:
    """Endurance of the flexures for a cycle between the first and the last of some states; None without a stress.

    In each state, the stress is taken as positive if the input is positive, and else as negative.
    """
    if not isfinite(states[0].stress_mpa):
        return None
    ends = sorted(copysign(state.stress_mpa, state.input_mm) for state in (states[0], states[-1]))
    return endurance(material, ends[0], ends[1])


def unit_of(name: str) -> str:
    """Unit of a characteristic number, taken from the end of its name."""
    if name.endswith("]"):
        return name[name.rindex("[") + 1 : -1]
    return _UNITS.get(name) or next((unit for end, unit in _ENDS.items() if name.endswith(end)), "1")


def with_unit(name: str) -> str:
    """Name of a characteristic number with its unit in brackets; a ratio has none."""
    unit = unit_of(name)
    return name if unit == "1" or name.endswith("]") else f"{name} [{unit}]"


def label_of(name: str) -> str:
    """Axis label of a characteristic number: its name in words, a slash, and its unit."""
    unit = unit_of(name)
    bare = name[: name.rindex(" [")] if name.endswith("]") else name
    for end in ("_mpa_per_mm", "_n_mm", "_deg_per_mm", *_ENDS):
        if bare.endswith(end):
            bare = bare.removesuffix(end) + (" per input" if end in ("_mpa_per_mm", "_deg_per_mm") else "")
            break
    return f"{bare.replace('_', ' ')} / {f'({unit})' if '/' in unit else unit}"
