"""Characteristic numbers of a mechanism that is described by its bodies, for any kind of model."""

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import ModelError
from fingervision.models.elastic_mechanism import ElasticMechanism, named_by_drive
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.grip import Part
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.out_of_plane import MODE_ERROR, SAG_ERROR, out_of_plane
from fingervision.models.rigid_bodies import RigidBodies

# Effects of weight, temperature and a part between two probes on a mechanism, for small displacements.
#
# The effects of weight, temperature and a gripped part are computed by finite elements. A frame of bars would give
# wrong results, because its bars end where their axes meet, unlike the bars of the drawing.

Array = NDArray[np.float64]

_MODE_ERROR = 0.005
"""Relative error of a natural frequency beside that of the stiffness, of which it is the square root."""
_MOTION_ERROR = 0.3
"""Relative error of motions, of the largest motion of a probe, over that of the force: motions follow from the ratios
of stiffnesses that are wrong alike (`tests/benchmarks/models_three_dimensions.py`)."""
_STILL = 1e-3
"""Smallest change of a pair's distance, as a share of the input, for a pair that can grip a part."""


def operating_figures_of(model: MechanismPlate) -> dict[str, float]:
    """Compute mechanical advantage, and the effects of weight and temperature.

    Under weight and temperature the drive keeps its position, and so do the fixed faces and the sliding faces in their
    fixed direction.

    Parameters
    ----------
    model : MechanismPlate
        Model of the drawing.

    Returns
    -------
    dict of str to float
        Numbers by name, with the unit at the end of the name.
    """
    figures: dict[str, float] = {}
    for name in model.pair_rows:
        if (pressed := GrippedPair(model, name)).per_input:
            figures[f"{name}: mechanical advantage [N/N]"] = pressed.mechanical_advantage
    for way, direction in (("-y", (0.0, -1.0)), ("x", (1.0, 0.0))):
        hung = model.under_weight(direction)
        for name, row in model.pair_rows.items():
            figures[f"{name}: by its weight along {way} [mm]"] = float(row @ hung)
        for name, rows in model.probe_rows.items():
            figures[f"{name}: moved by its weight along {way} [mm]"] = float(np.hypot(*(rows @ hung)))
    if (warmed := per_kelvin(model)) is not None:
        grown, figures["force_per_kelvin_n"] = warmed
        for name, row in model.pair_rows.items():
            figures[f"{name}: per kelvin [mm/K]"] = float(row @ grown)
        for name, rows in model.probe_rows.items():
            for axis, row in zip("xy", rows, strict=True):
                figures[f"{name}: {axis} per kelvin [mm/K]"] = float(row @ grown)
    return figures


def per_kelvin(model: MechanismPlate) -> tuple[Array, float] | None:
    """Displacements (mm) and force at the held drive (N) per kelvin; None if the material states no expansion.

    A free body expands without stress, each node by the strain times its position x. The displacements u therefore
    satisfy K (u - strain x) = 0 at every unknown that is not fixed, with K the stiffness matrix.
    """
    plate, system = model.plate, model.driven
    expansion = plate.material.thermal_expansion_per_k
    if expansion is None:
        return None
    free = np.zeros(plate.unknowns)
    free[plate.x_dofs], free[plate.y_dofs] = expansion * plate.nodes_mm
    grown = system.under_load(system.body_stiffness_n_mm @ free)
    loads = system.body_stiffness_n_mm @ (grown - free)
    return grown, float(system.per_input @ system.drive_forces_n(np.zeros(system.per_input.size), grown, loads))


@dataclass(frozen=True, slots=True)
class PairGrip:
    """State of a part gripped between the two probes of a pair, at one input.

    Parameters
    ----------
    input_mm, distance_mm : float
        Input of the drive, and distance between the probes of the pair.
    grip_n, force_n : float
        Force on the part, and force at the drive along its direction.
    stress_mpa : float
        Largest stress in the flexures.
    """

    input_mm: float
    distance_mm: float
    grip_n: float
    force_n: float
    stress_mpa: float


class GrippedPair:
    """Two probes that press on a part between them, along the line that joins them.

    The part touches at the probes, over a patch as large as the elements there; the indentation of the body is not
    resolved.

    Parameters
    ----------
    model : MechanismPlate
        Model of the drawing.
    pair : str
        Name of the pair.
    """

    def __init__(self, model: MechanismPlate, pair: str) -> None:
        self.model, self.pair = model, pair
        row = model.pair_rows[pair]
        change = float(row @ model.driven.unit_displacement)
        self.per_input = change if abs(change) > _STILL else 0.0
        self.rest_mm = model.state(0.0).pairs_mm[pair]
        self._pushed = model.driven.under_load(row)
        self.compliance_mm_n = float(row @ self._pushed)

    @property
    def mechanical_advantage(self) -> float:
        """Gripping force on a rigid part per drive force, after first touch; the remaining drive force bends flexures.

        By Betti's theorem, the gripping force N acts on the drive with N times the motion of the pair per unit of
        input.
        """
        grip = abs(self.per_input) / self.compliance_mm_n
        return grip / (self.model.stiffness_n_mm + grip * abs(self._force_per_grip))

    @property
    def _force_per_grip(self) -> float:
        """Change of the drive's force per 1 N of grip; by Betti's theorem, -`per_input` for a stage."""
        system, row = self.model.driven, self.model.pair_rows[self.pair]
        if system.actuators is None:
            return -self.per_input
        still = np.zeros(system.per_input.size)
        loads = system.stiffness_n_mm @ self._pushed - row
        return float(system.per_input @ system.drive_forces_n(still, self._pushed, loads))

    def touch_input_mm(self, part: Part) -> float:
        """Input at which the fingers first touch the part (mm).

        Raises
        ------
        ModelError
            If the drive does not move the probes towards each other.
        """
        if not self.per_input:
            raise ModelError(
                f"The drive of {self.model.mechanism.name} must change the distance of pair {self.pair} so that it "
                f"grips a part, but the distance changes by less than {_STILL:g} of the input."
            )
        return (part.width_mm - self.rest_mm) / self.per_input

    def at(self, input_mm: float, part: Part) -> PairGrip:
        """Find the equilibrium with the gripped part at one input."""
        model = self.model
        free_mm = self.rest_mm + self.per_input * input_mm
        pressed_mm = max(part.width_mm - free_mm, 0.0)
        grip = pressed_mm / (self.compliance_mm_n + 1.0 / part.stiffness_n_mm)
        free = model.driven.equilibrium(input_mm)
        force, stress = (
            free.force_n + grip * self._force_per_grip,
            model.peak_stress(free.displacement + grip * self._pushed),
        )
        return PairGrip(input_mm, free_mm + grip * self.compliance_mm_n, grip, force, stress.mpa)


MechanismModel = MechanismPlate | MechanismFrame | RigidBodies
MECHANISM_MODELS: dict[str, type[MechanismModel]] = {
    model.kind: model for model in (MechanismPlate, MechanismFrame, RigidBodies)
}
"""Kinds of model of a drawing by bodies, the most trusted first."""


def quickest_model(mechanism: Mechanism) -> MechanismFrame | MechanismPlate:
    """Build the model that takes the least time for many drawings: lumped, if there are flexures."""
    return MechanismFrame(mechanism) if mechanism.flexures else MechanismPlate(mechanism)


def response_figures(model: MechanismModel) -> dict[str, float]:
    """Compute response per 1 mm of input, input range up to yield, inputs of first contact, natural frequencies.

    Parameters
    ----------
    model : MechanismPlate, MechanismFrame or RigidBodies
        Model of the drawing.

    Returns
    -------
    dict of str to float
        Numbers by name, with the unit at the end of the name.
    """
    unit, rest, system = model.state(1.0), model.state(0.0), model.driven
    figures = {"input_stiffness_n_mm": model.stiffness_n_mm}
    if isfinite(unit.stress_mpa):
        figures["peak_stress_mpa_per_mm"] = model.stress_mpa_per_mm
        figures["input_at_yield_mm"] = model.input_at_yield_mm
    if np.any(system.rest_mm):
        figures |= {"preload_stress_mpa": rest.stress_mpa} if isfinite(rest.stress_mpa) else {}
        for name, force in rest.drives_n.items():
            figures[f"{name}: preload [N]"] = force
        for name, sag in named_by_drive(model.mechanism, system.rest_faces_mm).items():
            figures[f"{name}: moved by the preload [mm]"] = sag
    for name, moved in unit.probes_mm.items():
        for axis, end, start in zip("xy", moved, rest.probes_mm[name], strict=True):
            figures[f"{name}: {axis} per input [mm/mm]"] = end - start
    for name, pose in unit.bodies.items():
        figures[f"{name}: turn per input [mrad/mm]"] = pose.angle_mrad - rest.bodies[name].angle_mrad
    for name, value in unit.pairs_mm.items():
        figures[f"{name}: at rest [mm]"] = rest.pairs_mm[name]
        figures[f"{name}: per input [mm/mm]"] = value - rest.pairs_mm[name]
    for drive in model.mechanism.drives:
        if drive.is_soft:
            name = drive.face.name
            figures[f"{name}: motion per input [mm/mm]"] = unit.faces_mm[name]
    if len(model.mechanism.drives) > 1:
        figures |= _of_drives(model)
    for name, value in model.touch_input_mm().items():
        figures[f"{name}: input at contact [mm]"] = value
    # Where the preload makes the drive's stiffness negative, a free drive does not vibrate, but moves away.
    for held, label in (((False, "drive_free"),) if model.stiffness_n_mm > 0.0 else ()) + ((True, "drive_held"),):
        for place, value in enumerate(model.modes_hz(drive_held=held), 1):
            figures[f"mode_{place}_{label}_hz"] = value
    return figures


def mechanism_figures(model: MechanismModel) -> dict[str, float]:
    """Compute the figures of `response_figures`, and the errors of the model.

    Finite elements also give the effects of weight, temperature and a gripped part, and the motions out of the plane.

    Parameters
    ----------
    model : MechanismPlate, MechanismFrame or RigidBodies
        Model of the drawing.

    Returns
    -------
    dict of str to float
        Numbers by name, with the unit at the end of the name.
    """
    figures = response_figures(model)
    errors = {
        "model_error_motion_percent": 100.0 * _MOTION_ERROR * model.force_error,
        "model_error_force_percent": 100.0 * model.force_error,
    }
    if "mode_1_drive_free_hz" in figures:
        of_modes = 0.5 * model.force_error + model.mechanism.mode_error + _MODE_ERROR
        errors["model_error_modes_percent"] = 100.0 * of_modes
    if "peak_stress_mpa_per_mm" in figures:
        errors["model_error_stress_percent"] = 100.0 * model.stress_error
    if isinstance(model, MechanismPlate):
        buckles = min(model.buckling_inputs_mm().tolist(), key=abs)
        if abs(buckles) < figures.get("input_at_yield_mm", 0.0):
            figures["input_at_buckling_mm"] = buckles
        figures |= operating_figures_of(model)
        if not np.any(model.driven.rest_mm):  # the preload also changes the stiffness out of the plane
            across = out_of_plane(model.mechanism)
            figures["first_out_of_plane_mode_hz"] = across.modes_hz[0]
            figures |= {f"{name}: sag out of the plane [mm]": value for name, value in across.sag_mm.items()}
            errors["model_error_out_of_plane_percent"] = 100.0 * MODE_ERROR
            errors["model_error_sag_percent"] = 100.0 * SAG_ERROR
    return figures | errors


def width_effect(model: ElasticMechanism) -> dict[str, float]:
    """Compute by how many per cent the restraint of the flexures by the plate's width raises the force, if at all.

    It is left out of `mechanism_figures`, because it takes a second model, and sweeps compute many drawings.
    """
    is_held = model.mechanism.flexures or model.mechanism.held_bodies is not None
    if not is_held or np.any(model.driven.rest_mm) or (plane := model.in_plane_stress) is None:
        return {}
    return {"width_effect_force_percent": 100.0 * (model.stiffness_n_mm / plane.stiffness_n_mm - 1.0)}


def _of_drives(model: MechanismModel) -> dict[str, float]:
    """Response to each of several driven faces, with the other faces at rest, and the face's share of the force."""
    together, rest = model.state(1.0), model.state(0.0)
    figures = {f"{name}: force per input [N/mm]": n - rest.drives_n[name] for name, n in together.drives_n.items()}
    for name, alone in zip(together.drives_n, model.drive_states(), strict=True):
        for other, force in alone.drives_n.items():
            figures[f"{other}: force per mm of {name} [N/mm]"] = force - rest.drives_n[other]
        for probe, moved in alone.probes_mm.items():
            for axis, end, start in zip("xy", moved, rest.probes_mm[probe], strict=True):
                figures[f"{probe}: {axis} per mm of {name} [mm/mm]"] = end - start
        for pair, length in alone.pairs_mm.items():
            figures[f"{pair}: per mm of {name} [mm/mm]"] = length - rest.pairs_mm[pair]
    return figures
