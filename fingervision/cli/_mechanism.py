"""`fingervision model mechanism.toml`: model a planar mechanism with finite elements and with lumped flexures."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.cli._mechanism_files import draw_deformed, draw_over_input, write_figures, write_states
from fingervision.cli._mechanism_report import add_endurance, print_figures, say_endurance, warn
from fingervision.cli._model_grip import part_of_pair, write_pair_grip
from fingervision.cli._model_motion import MotionAsked, move_mechanism
from fingervision.cli._model_sweep import sweep_mechanism
from fingervision.cli._model_uncertainty import write_uncertainty
from fingervision.domain.errors import ArgumentError, FingervisionError, InstallationError, OutputError, UsageError
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_chain import MechanismChain
from fingervision.models.mechanism_figures import MechanismModel, mechanism_figures
from fingervision.models.mechanism_frame import MechanismFrame
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.mechanism_state import MechanismState
from fingervision.models.mechanism_uncertainty import mechanism_uncertainty
from fingervision.storage.mechanism_toml import read_drawing

_KINDS = ("finite_element", "lumped")
_ROWS = 21
_MOST_ROWS = 41
_OF_YIELD = 0.5
"""Range of inputs without a drive table, in both directions, as a fraction of the input at which the flexures yield."""


def predict(
    path: Path,
    kind: str,
    drive: Path | None,
    columns: Path | None,
    out: Path,
    asked: MotionAsked,
    vary: tuple[str, ...],
    *,
    object_mm: float | None,
    object_n_mm: float | None,
    large_rotation: bool,
    contact: bool,
    mesh: bool,
    as_json: bool,
) -> None:
    """Write and print the table of results; write mechanism.csv, simulation.csv (if a pair is named gap) and plots."""
    from fingervision.cli._model_figures import draw_mesh
    from fingervision.tables.read import read_drive

    drawing = read_drawing(path)
    if vary:
        sweep_mechanism(drawing, vary, out, as_json=as_json)
        return
    with _naming(path):
        mechanism = drawing.mechanism()
    gripped = part_of_pair(object_mm, object_n_mm, mechanism)
    if contact and not mechanism.contacts:
        raise UsageError(f"--contact needs a [[contact]] section that says which faces may touch, but {path} has none.")
    if kind not in (*_KINDS, "stiffness_matrix", "all"):
        raise UsageError(
            f"A mechanism.toml can be computed by the kinds of model {', '.join(_KINDS)}, but --kind is {kind}."
        )
    models, table = _figures(path, mechanism, _KINDS if kind == "all" else (kind,))
    chief = next(iter(models))
    at_yield_mm = table[chief]["input_at_yield_mm"]
    driven = None if drive is None else np.unique(read_drive(drive, columns).input_mm)
    touching = models[chief].touch_input_mm().values() if contact and driven is not None else ()
    inputs = _inputs_mm(driven, at_yield_mm, touching, is_curved=large_rotation or contact)
    states = {name: [model.state(float(value), large_rotation=large_rotation, contact=contact) for value in inputs]
              for name, model in models.items()}  # fmt: skip
    _write_states(states, chief, out)
    plate = models.get("finite_element")
    if isinstance(plate, MechanismPlate):
        shown = max(states["finite_element"], key=lambda state: abs(state.input_mm))
        draw_deformed(plate, shown, out / "deformed.png", large=large_rotation)
        if mesh:
            draw_mesh(plate.mesh, mechanism.name, out / "mesh.png")
    elif mesh:
        click.echo("--mesh draws the mesh of the finite elements: add --kind finite_element.", err=True)
    draw_over_input(mechanism, states, out / "models.png")
    for name, rows in states.items():
        add_endurance(mechanism, rows, table[name])
    write_figures(table, out / "models.csv")
    print_figures(mechanism.name, table, as_json=as_json)
    if drawing.estimates:
        spread = mechanism_uncertainty(drawing.mechanism, drawing.estimates)
        write_uncertainty(spread, table, mechanism.name, out, as_json=as_json)
    moving = {name: model for name, model in models.items() if isinstance(model, MechanismPlate | MechanismFrame)}
    if moving:
        bent = (large_rotation or contact) and asked.drive is not None
        curves = {name: _curve(states[name]) for name in moving if bent}
        folders = {name: out if name == chief else out / name for name in moving}
        move_mechanism(moving, asked, curves, folders, out, as_json=as_json)
    elif asked.moves:
        click.echo(
            "The model kind stiffness_matrix has no masses and cannot compute motion: choose --kind lumped or "
            "finite_element.",
            err=True,
        )
    if gripped is not None:
        write_pair_grip(models, gripped, None if drive is None else inputs, out, as_json=as_json)
    if not as_json:
        say_endurance(chief, mechanism, states[chief])
    warn(mechanism, models[chief], states[chief], table, contact=contact)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Add the name of the drawing's file to the message of an error that is raised in the `with` block."""
    try:
        yield
    except FingervisionError as error:
        if str(path) in str(error) or isinstance(error, ArgumentError | InstallationError):
            raise
        raise type(error)(f"In {path}: {error}") from error


def _write_states(states: dict[str, list[MechanismState]], chief: str, out: Path) -> None:
    """Write the tables of every kind: the chief one's into the folder itself, the others' into folders of their own."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"--out must be a folder that can be written, but {out}: {error.strerror}.") from error
    for name, rows in states.items():
        folder = out if name == chief else out / name
        folder.mkdir(exist_ok=True)
        write_states(rows, folder)


def _figures(
    path: Path, mechanism: Mechanism, kinds: tuple[str, ...]
) -> tuple[dict[str, MechanismModel], dict[str, dict[str, float]]]:
    """Models of several kinds with their figures; if one of several kinds fails, the others are still computed."""
    models: dict[str, MechanismModel] = {}
    table: dict[str, dict[str, float]] = {}
    refusals: dict[str, FingervisionError] = {}
    for name in kinds:
        try:
            with _naming(path):
                model = _built(name, mechanism)
                table[name] = mechanism_figures(model)
        except FingervisionError as error:
            refusals[name] = error
        else:
            models[name] = model
    if not models:
        raise next(iter(refusals.values()))
    for name, refusal in refusals.items():
        click.echo(f"{name} could not be computed: {refusal}", err=True)
    return models, table


def _inputs_mm(
    driven: NDArray[np.float64] | None, at_yield_mm: float, touching: Iterable[float], *, is_curved: bool
) -> NDArray[np.float64]:
    """Inputs of the static table (mm): those of the drive table, or enough evenly spaced inputs for a smooth curve."""
    if driven is None:
        return np.linspace(-_OF_YIELD, _OF_YIELD, _ROWS) * at_yield_mm
    if driven.size < 2:
        raise UsageError(f"--drive must hold at least two different inputs, but holds {driven.size}.")
    inputs = driven if driven.size <= _MOST_ROWS else np.linspace(driven[0], driven[-1], _MOST_ROWS)
    if not is_curved:
        return inputs
    # A table is interpolated linearly between its rows, but these results are curved.
    touches = [at for at in touching if inputs[0] < at < inputs[-1]]
    return np.union1d(inputs, np.concatenate([np.linspace(inputs[0], inputs[-1], _ROWS), touches]))


def _curve(states: list[MechanismState]) -> PchipInterpolator:
    """Lengths and force over the input, in the column order of the dynamic response; contacts may cause kinks."""
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
