"""`fingervision model mechanism.toml`: any planar mechanism, by finite elements and by lumped flexures."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.cli._body_picture import draw_body, extent_mm, framed
from fingervision.cli._model_motion import MotionAsked, move_mechanism
from fingervision.cli._model_sweep import sweep_mechanism
from fingervision.cli._model_uncertainty import write_uncertainty
from fingervision.domain.errors import ArgumentError, FingervisionError, InstallationError, OutputError, UsageError
from fingervision.models.gripper_figures import unit_of
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_chain import MechanismChain
from fingervision.models.mechanism_figures import MechanismModel, mechanism_figures
from fingervision.models.mechanism_frame import MechanismFrame
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.mechanism_state import MechanismState
from fingervision.models.mechanism_uncertainty import mechanism_uncertainty
from fingervision.storage.mechanism_toml import read_drawing
from fingervision.storage.simulation_csv import POSE

_KINDS = ("finite_element", "lumped")
_APART = 0.1
"""Relative: kinds that differ by more beyond their stated errors are worth a sentence (the issue's own bar)."""
_ROWS = 21
_MOST_ROWS = 41
_OF_YIELD = 0.5
"""Without a drive, inputs up to half of what makes the flexures yield are answered, either way."""


def predict(
    path: Path,
    kind: str,
    drive: Path | None,
    columns: Path | None,
    out: Path,
    asked: MotionAsked,
    vary: tuple[str, ...],
    *,
    large_rotation: bool,
    contact: bool,
    mesh: bool,
    as_json: bool,
) -> None:
    """Write mechanism.csv (and simulation.csv where a pair is called gap), deformed.png, and print the figures."""
    from fingervision.cli._model_figures import draw_mesh
    from fingervision.tables.read import read_drive

    drawing = read_drawing(path)
    if vary:
        sweep_mechanism(drawing, vary, out, as_json=as_json)
        return
    with _naming(path):
        mechanism = drawing.mechanism()
    if contact and not mechanism.contacts:
        raise UsageError(f"--contact needs a [[contact]] section that says which faces may touch, but {path} has none.")
    if kind not in (*_KINDS, "stiffness_matrix", "all"):
        raise UsageError(f"A mechanism.toml is computed by the kinds {', '.join(_KINDS)}, but --kind asks for {kind}.")
    wanted = _KINDS if kind == "all" else (kind,)
    models: dict[str, MechanismModel] = {}
    refusals: dict[str, FingervisionError] = {}
    table: dict[str, dict[str, float]] = {}
    for name in wanted:
        try:
            with _naming(path):
                model = _built(name, mechanism)
                table[name] = mechanism_figures(model)
        except FingervisionError as error:
            # One kind's failure leaves the others their results.
            if kind != "all":
                raise
            refusals[name] = error
            continue
        models[name] = model
    if not models:
        raise next(iter(refusals.values()))
    for name, refusal in refusals.items():
        click.echo(f"{name} could not be computed: {refusal}", err=True)
    chief = next(iter(models))
    at_yield_mm = table[chief]["input_at_yield_mm"]
    if drive is None:
        inputs = np.linspace(-_OF_YIELD, _OF_YIELD, _ROWS) * at_yield_mm
    else:
        inputs = _inputs_mm(np.unique(read_drive(drive, columns).input_mm))
        if large_rotation or contact:
            # A table is read as straight between its rows, and these answers bend.
            touches = [at for at in models[chief].touch_input_mm().values() if contact and inputs[0] < at < inputs[-1]]
            inputs = np.union1d(inputs, np.concatenate([np.linspace(inputs[0], inputs[-1], _ROWS), touches]))
    states = {name: [model.state(float(value), large_rotation=large_rotation, contact=contact) for value in inputs]
              for name, model in models.items()}  # fmt: skip
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"--out must be a folder that can be written, but {out}: {error.strerror}.") from error
    for name, rows in states.items():
        folder = out if name == chief else out / name
        folder.mkdir(exist_ok=True)
        _write(rows, folder)
    plate = models.get("finite_element")
    if isinstance(plate, MechanismPlate):
        shown = max(states["finite_element"], key=lambda state: abs(state.input_mm))
        _draw(plate, shown, out / "deformed.png", large=large_rotation)
        if mesh:
            draw_mesh(plate.mesh, mechanism.name, out / "mesh.png")
    elif mesh:
        click.echo("--mesh draws the mesh of the finite elements: add --kind finite_element.", err=True)
    _print(mechanism.name, table, as_json=as_json)
    if drawing.estimates:
        spread = mechanism_uncertainty(drawing.mechanism, drawing.estimates)
        write_uncertainty(spread, table, mechanism.name, out, as_json=as_json)
    if isinstance(plate, MechanismPlate):
        bent = large_rotation or contact
        curve = _curve(states["finite_element"]) if bent and asked.drive is not None else None
        move_mechanism(plate, asked, curve, out, as_json=as_json)
    elif asked.moves:
        click.echo("Motion is answered by the finite elements: add --kind finite_element.", err=True)
    _warn(mechanism, models[chief], states[chief], table, contact=contact)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Add the drawing's file name to an error."""
    try:
        yield
    except FingervisionError as error:
        if str(path) in str(error) or isinstance(error, ArgumentError | InstallationError):
            raise
        raise type(error)(f"In {path}: {error}") from error


def _inputs_mm(inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inputs of the static table: the drive's own inputs, or as many as a curve needs."""
    if inputs.size < 2:
        raise UsageError(f"--drive must hold at least two different inputs, but holds {inputs.size}.")
    return inputs if inputs.size <= _MOST_ROWS else np.linspace(inputs[0], inputs[-1], _MOST_ROWS)


def _curve(states: list[MechanismState]) -> PchipInterpolator:
    """Lengths and force over the input, in the column order of a motion; a contact may bend the curve sharply."""
    rows = [
        [*state.pairs_mm.values(), *(part for probe in state.probes_mm.values() for part in probe), state.force_n]
        for state in states
    ]
    return PchipInterpolator([state.input_mm for state in states], rows)


def _built(name: str, mechanism: Mechanism) -> MechanismModel:
    if name == "finite_element":
        return MechanismPlate(mechanism)
    if name == "lumped":
        return MechanismFrame(mechanism)
    return MechanismChain(mechanism)


def _print(name: str, table: dict[str, dict[str, float]], *, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps(table, indent=2))
        return
    click.echo(f"{name:<44}" + "".join(f"{kind:>18}" for kind in table))
    labels = list(dict.fromkeys(label for figures in table.values() for label in figures))
    for label in labels:
        cells = (f"{figures[label]:.6g}" if label in figures else "-" for figures in table.values())
        shown = label if label.endswith("]") else f"{label} [{unit_of(label)}]"
        click.echo(f"{shown:<44}" + "".join(f"{cell:>18}" for cell in cells))


def _warn(
    mechanism: Mechanism, model: MechanismModel, states: list[MechanismState], table: dict[str, dict[str, float]], *,
    contact: bool,
) -> None:  # fmt: skip
    """Warn of limits of the results: yield, faces that penetrate each other, kinds that differ."""
    worst = max(states, key=lambda state: state.stress_mpa)
    if worst.stress_mpa > mechanism.material.yield_mpa:
        at_yield_mm = next(iter(table.values()))["input_at_yield_mm"]
        click.echo(
            f"Warning: at an input of {worst.input_mm:.3g} mm the stress in the flexures must stay below the yield of "
            f"{mechanism.material.yield_mpa:g} MPa, but is {worst.stress_mpa:.3g} MPa; stay within "
            f"{at_yield_mm:.3g} mm.",
            err=True,
        )
    ends = [state.input_mm for state in (states[0], states[-1])]
    for name, at_mm in model.touch_input_mm().items():
        if not contact and min(ends) < at_mm < max(ends):
            click.echo(
                f"Warning: the faces of contact {name} touch at an input of {at_mm:.4g} mm, and beyond it this answer "
                "lets them pass through each other; add --contact.",
                err=True,
            )
    if len(table) > 1:
        first, second = list(table)[:2]
        for label in ("input_stiffness_n_mm", "mode_1_drive_free_hz"):
            if label not in table[first] or label not in table[second]:
                continue
            apart = table[second][label] / table[first][label] - 1.0
            stated = sum(figures["model_error_force_percent"] for figures in (table[first], table[second])) / 100.0
            if abs(apart) > _APART + stated:
                click.echo(
                    f"Warning: {second} differs from {first} by {100.0 * apart:.3g} % in {label}, more than their "
                    f"model errors of together {100.0 * stated:.2g} % leave; trust {first}.",
                    err=True,
                )


def _write(states: list[MechanismState], out: Path) -> None:
    columns: dict[str, list[float]] = {"input_mm": [s.input_mm for s in states], "force_n": [s.force_n for s in states]}
    for name in states[0].probes_mm:
        for place, axis in enumerate("xy"):
            columns[f"{name}_{axis}_mm"] = [s.probes_mm[name][place] for s in states]
    for name in states[0].pairs_mm:
        columns[f"{name}_mm"] = [s.pairs_mm[name] for s in states]
    for name in states[0].contact_n:
        columns[f"{name}_contact_n"] = [s.contact_n[name] for s in states]
    columns["stress_mpa"] = [s.stress_mpa for s in states]
    poses = {
        f"{name}.{part}": [getattr(s.bodies[name], part) for s in states] for name in states[0].bodies for part in POSE
    }
    columns |= poses
    _table(columns, out / "mechanism.csv")
    if "gap" in states[0].pairs_mm:
        table = {name: columns[name] for name in ("input_mm", "gap_mm", "force_n")} | poses
        _table(table, out / "simulation.csv")


def _table(columns: dict[str, list[float]], path: Path) -> None:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _draw(model: MechanismPlate, state: MechanismState, path: Path, *, large: bool) -> None:
    plate = model.plate
    moved: NDArray[np.float64] = state.displacement_mm
    stress = plate.at_corners(plate.von_mises_mpa(moved, large=large))
    figure, axes = framed(*extent_mm(plate, moved))
    colours = draw_body(axes, plate, moved, stress, max(state.stress_mpa, 1e-9))
    axes.set_title(
        f"{model.mechanism.name}: input {state.input_mm:.3g} mm, to scale, force {state.force_n:.3g} N\n"
        f"largest stress in a flexure {state.stress_mpa:.3g} MPa (yield {model.mechanism.material.yield_mpa:g} MPa)",
        fontsize="medium",
    )
    figure.colorbar(colours, ax=axes, label="von Mises stress / MPa", shrink=0.8)
    figure.savefig(path, dpi=130)
