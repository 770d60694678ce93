"""`fingervision model mechanism.toml`: model a planar mechanism with finite elements and with lumped flexures."""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import click
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.cli._body_picture import draw_body, extent_mm, framed
from fingervision.cli._mechanism_report import add_endurance, print_figures, say_drawing, say_endurance, warn
from fingervision.cli._model_grip import part_of_pair, write_pair_grip
from fingervision.cli._model_motion import MotionAsked, move
from fingervision.cli._model_sweep import solve_mechanism, sweep_mechanism
from fingervision.cli._model_uncertainty import write_uncertainty
from fingervision.domain.errors import ArgumentError, FingervisionError, InstallationError, OutputError, UsageError
from fingervision.models.elastic_mechanism import MechanismState
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_chain import MechanismChain
from fingervision.models.mechanism_figures import MechanismModel, mechanism_figures
from fingervision.models.uncertainty import mechanism_uncertainty
from fingervision.storage.mechanism_toml import read_drawing
from fingervision.storage.simulation_table import POSE

# Tables and plots of a mechanism whose drawing lists its bodies (mechanism.toml).

_STYLES = ("-", "--", "-.")
_IN_PLOT = 4
"""Most curves of a plot whose legend fits into it."""
_STILL = 0.01
"""If the relative change of a distance is smaller, the distance is plotted without its mean, whose digits would hide
the change."""


def write_figures(table: Mapping[str, Mapping[str, float]], path: Path) -> None:
    """Write models.csv: one line per kind of model, with empty cells for results that a kind does not compute."""
    labels = list(dict.fromkeys(label for figures in table.values() for label in figures))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["kind", *labels])
        for kind, figures in table.items():
            writer.writerow([kind, *(f"{figures[label]:.7g}" if label in figures else "" for label in labels)])


def write_states(states: Sequence[MechanismState], out: Path) -> None:
    """Write mechanism.csv, and also simulation.csv if a pair of probes is named gap."""
    columns: dict[str, list[float]] = {"input_mm": [s.input_mm for s in states], "force_n": [s.force_n for s in states]}
    if len(states[0].drives_n) > 1:
        columns |= {f"{name}_force_n": [s.drives_n[name] for s in states] for name in states[0].drives_n}
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
    lines = [",".join(columns), *(",".join("" if np.isnan(value) else f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def draw_deformed(model: MechanismPlate, state: MechanismState, path: Path, *, large: bool) -> None:
    """Plot the deformed mechanism at one input, with displacements to scale and coloured by stress."""
    plate = model.plate
    moved: NDArray[np.float64] = state.displacement_mm
    stress = plate.at_corners(plate.von_mises_mpa(moved, large=large))
    figure, axes = framed(*extent_mm(plate, moved))
    stated = np.isfinite(state.stress_mpa)
    said = f"largest stress in a flexure {state.stress_mpa:.3g} MPa" if stated else "largest stress not stated"
    largest = state.stress_mpa if stated else float(np.percentile(stress, 99.0))
    colours = draw_body(axes, plate, moved, stress, max(largest, 1e-9))
    axes.set_title(
        f"{model.mechanism.name}: input {state.input_mm:.3g} mm, to scale, force {state.force_n:.3g} N\n"
        f"{said} (yield {model.mechanism.material.yield_mpa:g} MPa)",
        fontsize="medium",
    )
    figure.colorbar(colours, ax=axes, label="von Mises stress / MPa", shrink=0.8)
    figure.savefig(path, dpi=130)


def draw_over_input(mechanism: Mechanism, states: Mapping[str, Sequence[MechanismState]], path: Path) -> None:
    """Plot distances of probe pairs (or single probes), force and stress over the input, for every kind of model."""
    figure = Figure(figsize=(9.5, 8.5), layout="constrained")
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 2))
    for place, (kind, rows) in enumerate(states.items()):
        inputs = [state.input_mm for state in rows]
        style = _STYLES[place % len(_STYLES)]
        for number, (name, lengths) in enumerate(_lengths(mechanism, rows).items()):
            still = np.ptp(lengths) < _STILL * max(np.abs(lengths))
            rest = round(float(np.mean(lengths)), 6) if still else 0.0
            shown = f"{name} minus {rest:g} mm" if rest else name
            upper.plot(inputs, np.array(lengths) - rest, style, color=f"C{number}", label=f"{shown} ({kind})")
        middle.plot(inputs, [state.force_n for state in rows], style, color="0.2", label=kind)
        for number, name in enumerate(rows[0].drives_n if len(mechanism.drives) > 1 else ()):
            forces = [state.drives_n[name] for state in rows]
            middle.plot(inputs, forces, style, color=f"C{number}", label=f"{name} ({kind})")
        lower.plot(inputs, [state.stress_mpa for state in rows], style, color="0.2", label=kind)
    upper.set_ylabel("distance / mm" if mechanism.pairs else "displacement / mm")
    if upper.lines:
        _beside(upper)
    middle.set_ylabel("force of the input / N" if len(mechanism.drives) > 1 else "force at the drive / N")
    _beside(middle)
    lower.axhline(mechanism.material.yield_mpa, color="C3", linewidth=0.8, linestyle=":")
    lower.annotate("yield", (1.0, mechanism.material.yield_mpa), xycoords=("axes fraction", "data"), color="C3",
                   xytext=(-4, -3), textcoords="offset points", ha="right", va="top", fontsize="small")  # fmt: skip
    lower.set_ylabel("stress in the flexures / MPa")
    lower.set_xlabel("input / mm")
    for axes in (upper, middle, lower):
        axes.grid(alpha=0.3)
    upper.set_title(f"{mechanism.name}: over the input")
    figure.savefig(path, dpi=130)


def _beside(axes: Axes) -> None:
    """Put a legend into the plot, or beside it where it would hide the curves."""
    if len(axes.lines) > _IN_PLOT:
        axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1.0))
    else:
        axes.legend(fontsize="small")


def _lengths(mechanism: Mechanism, rows: Sequence[MechanismState]) -> dict[str, list[float]]:
    if mechanism.pairs:
        return {name: [state.pairs_mm[name] for state in rows] for name in mechanism.pairs}
    return {
        f"{name} {axis}": [state.probes_mm[name][place] for state in rows]
        for name in mechanism.probes
        for place, axis in enumerate("xy")
    }


_KINDS = ("finite_element", "lumped")
_ROWS = 21
_MOST_ROWS = 41
_OF_SIZE = 0.02
"""Input that takes the place of the one at yield where no stress is stated, as a share of the drawing's size."""
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
    solve: tuple[tuple[str, ...], tuple[str, ...]],
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
    if any(solve):
        solve_mechanism(drawing, *solve, out, as_json=as_json)
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
    at_yield_mm = table[chief].get("input_at_yield_mm", _OF_SIZE * mechanism.region.size_mm)
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
    if not as_json:
        say_drawing(mechanism)
    if drawing.estimates:
        spread = mechanism_uncertainty(drawing.mechanism, drawing.estimates)
        write_uncertainty(spread, table, mechanism.name, out, as_json=as_json)
    bent = (large_rotation or contact) and asked.drive is not None
    curves = {name: _curve(states[name]) for name in models if bent}
    folders = {name: out if name == chief else out / name for name in models}
    if chief != "stiffness_matrix":
        move(models, asked, mechanism.name, folders, out, static=curves, as_json=as_json)
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
