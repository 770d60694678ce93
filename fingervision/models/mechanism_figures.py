"""Characteristic numbers of a mechanism that is described by its bodies, for any kind of model."""

from math import isfinite

from fingervision.models.mechanism_chain import MechanismChain
from fingervision.models.mechanism_frame import MechanismFrame
from fingervision.models.mechanism_loads import operating_figures_of
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.out_of_plane import MODE_ERROR, SAG_ERROR, out_of_plane

MechanismModel = MechanismPlate | MechanismFrame | MechanismChain


def mechanism_figures(model: MechanismModel) -> dict[str, float]:
    """Compute response per 1 mm of input, input range up to yield, inputs of first contact, natural frequencies.

    Finite elements also give the effects of weight, temperature and a gripped part, and the motions out of the plane.

    Parameters
    ----------
    model : MechanismPlate, MechanismFrame or MechanismChain
        Model of the drawing.

    Returns
    -------
    dict of str to float
        Numbers by name, with the unit at the end of the name.
    """
    unit, rest = model.state(1.0), model.state(0.0)
    figures = {"input_stiffness_n_mm": model.stiffness_n_mm}
    if isfinite(unit.stress_mpa):
        figures |= {
            "peak_stress_mpa_per_mm": unit.stress_mpa,
            "input_at_yield_mm": model.mechanism.material.yield_mpa / unit.stress_mpa,
        }
    for name, (x, y) in unit.probes_mm.items():
        figures[f"{name}: x per input [mm/mm]"] = x
        figures[f"{name}: y per input [mm/mm]"] = y
    for name, pose in unit.bodies.items():
        figures[f"{name}: turn per input [mrad/mm]"] = pose.angle_mrad
    for name, value in unit.pairs_mm.items():
        figures[f"{name}: at rest [mm]"] = rest.pairs_mm[name]
        figures[f"{name}: per input [mm/mm]"] = value - rest.pairs_mm[name]
    if len(model.mechanism.drives) > 1:
        figures |= _of_drives(model)
    for name, value in model.touch_input_mm().items():
        figures[f"{name}: input at contact [mm]"] = value
    for held, label in ((False, "drive_free"), (True, "drive_held")):
        for place, value in enumerate(model.modes_hz(drive_held=held), 1):
            figures[f"mode_{place}_{label}_hz"] = value
    errors = {"model_error_force_percent": 100.0 * model.force_error}
    if isfinite(unit.stress_mpa):
        errors["model_error_stress_percent"] = 100.0 * model.stress_error
    if isinstance(model, MechanismPlate):
        figures |= operating_figures_of(model)
        across = out_of_plane(model.mechanism)
        figures["first_out_of_plane_mode_hz"] = across.modes_hz[0]
        figures |= {f"{name}: sag out of the plane [mm]": value for name, value in across.sag_mm.items()}
        errors |= {"model_error_out_of_plane_percent": 100.0 * MODE_ERROR, "model_error_sag_percent": 100.0 * SAG_ERROR}
    return figures | errors


def _of_drives(model: MechanismModel) -> dict[str, float]:
    """Response to each of several driven faces, with the other faces at rest, and the face's share of the force."""
    together, rest = model.state(1.0), model.state(0.0)
    figures = {f"{name}: force per input [N/mm]": force for name, force in together.drives_n.items()}
    for name, alone in zip(together.drives_n, model.drive_states(), strict=True):
        figures |= {f"{other}: force per mm of {name} [N/mm]": force for other, force in alone.drives_n.items()}
        for probe, moved in alone.probes_mm.items():
            figures |= {f"{probe}: {axis} per mm of {name} [mm/mm]": m for axis, m in zip("xy", moved, strict=True)}
        for pair, length in alone.pairs_mm.items():
            figures[f"{pair}: per mm of {name} [mm/mm]"] = length - rest.pairs_mm[pair]
    return figures
