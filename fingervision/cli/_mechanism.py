"""`fingervision model mechanism.toml`: model a planar mechanism with finite elements and with lumped flexures."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import click
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.cli._model_figures import FigureStyle, draw_body, extent_mm, framed, save_figure
from fingervision.cli._model_grip import part_of_pair, write_pair_grip
from fingervision.cli._model_motion import MotionAsked, move
from fingervision.cli._model_report import add_endurance, say_drawing, say_endurance, say_refusals, warn
from fingervision.cli._model_sweep import solve_mechanism, sweep_mechanism, write_uncertainty
from fingervision.domain.errors import UsageError
from fingervision.interface.prediction import figures_csv, figures_text, naming, predict_mechanism
from fingervision.models.answer_figures import Physics
from fingervision.models.elastic_mechanism import MechanismState
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.mechanism import Mechanism
from fingervision.models.uncertainty import mechanism_uncertainty
from fingervision.storage.mechanism_toml import read_drawing
from fingervision.storage.out_folder import make_out_folder
from fingervision.storage.row_file import write_table

# Tables and plots of a mechanism whose drawing lists its bodies (mechanism.toml).

_STYLES = ("-", "--", "-.")
_REFINED = (0.5, 0.7, 1.0, 1.4)
"""Factors by which the meshes of a convergence table are finer than that of the model."""
_IN_PLOT = 4
"""Most curves of a plot whose legend fits into it."""
_STILL = 0.01
"""If the relative change of a distance is smaller, the distance is plotted without its mean, whose digits would hide
the change."""


def draw_deformed(model: MechanismPlate, state: MechanismState, path: Path, *, large: bool) -> None:
    """Plot the deformed mechanism at one input, coloured by stress or displacement."""
    plate = model.plate
    moved: NDArray[np.float64] = state.displacement_mm
    stress = plate.at_corners(plate.von_mises_mpa(moved, large=large))
    figure, axes = framed(*extent_mm(plate, moved))
    stated = np.isfinite(state.stress_mpa)
    said = f"largest stress in a flexure {state.stress_mpa:.3g} MPa" if stated else "largest stress not stated"
    largest = state.stress_mpa if stated else float(np.percentile(stress, 99.0))
    colours, label = draw_body(axes, plate, moved, stress, max(largest, 1e-9))
    axes.set_title(
        f"{model.mechanism.name}: input {state.input_mm:.3g} mm, force {state.force_n:.3g} N, "
        f"{FigureStyle.asked().words}\n"
        f"{said} (yield {model.mechanism.material.yield_mpa:g} MPa)",
        fontsize="medium",
    )
    figure.colorbar(colours, ax=axes, label=label, shrink=0.8)
    save_figure(figure, path)


def draw_over_input(mechanism: Mechanism, states: Mapping[str, Sequence[MechanismState]], path: Path) -> None:
    """Plot distances of probe pairs (or single probes), force and stress over the input, for every kind of model.

    Curves of several kinds coincide, so that what they differ by is plotted beside them.
    """
    curves = {kind: _curves(mechanism, rows) for kind, rows in states.items()}
    chief, first = next(iter(curves.items()))
    figure = Figure(figsize=(9.5 if len(curves) == 1 else 13.0, 2.8 * len(first)), layout="constrained")
    panels = figure.subplots(len(first), min(len(curves), 2), sharex=True, squeeze=False)
    for place, (kind, rows) in enumerate(states.items()):
        inputs = [state.input_mm for state in rows]
        style = _STYLES[place % len(_STYLES)]
        for axes, (label, named) in zip(panels, curves[kind].items(), strict=True):
            for number, (name, values) in enumerate(named.items()):
                colour = f"C{number - ('' in named)}" if name else "0.2"
                still = name and np.ptp(values) < _STILL * max(np.abs(values))
                rest = round(float(np.mean(values)), 6) if still else 0.0
                shown = f"{name} minus {rest:g} mm" if rest else name
                axes[0].plot(inputs, values - rest, style, color=colour, label=f"{shown} ({kind})" if name else kind)
                if place:
                    axes[1].plot(inputs, values - first[label][name], style, color=colour)
            axes[0].set_ylabel(label)
    if len(curves) > 1:
        panels[0, 1].set_title(f"minus {chief}")
    for axes in panels[:, 0]:
        _beside(axes)
    lowest = panels[-1, 0]
    lowest.axhline(mechanism.material.yield_mpa, color="C3", linewidth=0.8, linestyle=":")
    lowest.annotate("yield", (1.0, mechanism.material.yield_mpa), xycoords=("axes fraction", "data"), color="C3",
                    xytext=(-4, -3), textcoords="offset points", ha="right", va="top", fontsize="small")  # fmt: skip
    for axes in panels[-1]:
        axes.set_xlabel("input / mm")
    for axes in panels.flat:
        axes.grid(alpha=0.3)
    panels[0, 0].set_title(f"{mechanism.name}: over the input")
    save_figure(figure, path)


def _beside(axes: Axes) -> None:
    """Put a legend into the plot, or beside it where it would hide the curves."""
    if len(axes.lines) > _IN_PLOT:
        axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1.0))
    else:
        axes.legend(fontsize="small")


def _curves(mechanism: Mechanism, rows: Sequence[MechanismState]) -> dict[str, dict[str, NDArray[np.float64]]]:
    """Curves of one kind of model by the label of their axis and by name; the name of a whole mechanism's is empty."""
    if mechanism.pairs:
        lengths = {name: [state.pairs_mm[name] for state in rows] for name in mechanism.pairs}
    else:
        lengths = {
            f"{name} {axis}": [state.probes_mm[name][place] for state in rows]
            for name in mechanism.probes
            for place, axis in enumerate("xy")
        }
    forces = {"": [state.force_n for state in rows]}
    if len(mechanism.drives) > 1:
        forces |= {name: [state.drives_n[name] for state in rows] for name in rows[0].drives_n}
    found = {
        "distance / mm" if mechanism.pairs else "displacement / mm": lengths,
        "force of the input / N" if len(mechanism.drives) > 1 else "force at the drive / N": forces,
        "stress in the flexures / MPa": {"": [state.stress_mpa for state in rows]},
    }
    return {
        label: {name: np.array(values) for name, values in named.items()} for label, named in found.items() if named
    }


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
    with naming(path):
        mechanism = drawing.mechanism()
    gripped = part_of_pair(object_mm, object_n_mm, mechanism, kind)
    _refuse_what_is_not_computed(mechanism, kind, asked)
    driven = None if drive is None else np.unique(read_drive(drive, columns).input_mm)
    physics = Physics(large_rotation=large_rotation, contact=contact)
    found = predict_mechanism(path, drawing, kind, driven, physics)
    models, states, inputs = found.models, found.states, found.input_mm
    table = {name: dict(row) for name, row in found.figures.items()}
    say_refusals(found.refusals)
    chief = next(iter(models))
    folders = {name: out if name == chief else out / name for name in models}
    make_out_folder(out)
    for name, folder in folders.items():
        found.write(name, folder)
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
    (out / "models.csv").write_text(figures_csv(table), encoding="utf-8")
    words = json.dumps(table, indent=2) if as_json else figures_text(mechanism.name, table, digits=6, least=44)
    click.echo(words)
    if not as_json:
        say_drawing(mechanism, table[chief])
    if drawing.estimates:
        spread = mechanism_uncertainty(drawing.mechanism, drawing.estimates)
        write_uncertainty(spread, table, mechanism.name, out, as_json=as_json)
    bent = (large_rotation or contact) and asked.drive is not None
    curves = {name: _curve(states[name]) for name in models if bent}
    move(models, asked, mechanism.name, folders, out, static=curves, as_json=as_json)
    if gripped is not None:
        write_pair_grip(models, gripped, None if drive is None else inputs, out, as_json=as_json)
    if not as_json:
        say_endurance(chief, mechanism.material, states[chief])
    warn(mechanism, models[chief], states[chief], table[chief], contact=contact)
    for sentence in found.warnings:
        click.echo(f"Warning: {sentence}", err=True)


def write_convergence(mechanism: Mechanism, out: Path, *, as_json: bool) -> None:
    """Compute finite elements on meshes of four sizes, write convergence.csv, and print the table."""
    rows: list[list[float]] = []
    for refine in _REFINED:
        model = MechanismPlate(mechanism, refine=refine)
        moved, rest = (list(model.state(at).probes_mm.values()) for at in (1.0, 0.0))
        motions = np.subtract(moved, rest).ravel().tolist()
        stress_mpa = model.stress_mpa_per_mm
        mode_hz = model.modes_hz(drive_held=False, count=1)[0]
        triangles = model.mesh.triangles.shape[1]
        rows.append([refine, triangles, model.stiffness_n_mm, stress_mpa, mode_hz, *motions])
    names = ["refined", "triangles", "input_stiffness_n_mm", "peak_stress_mpa_per_mm", "mode_1_drive_free_hz"]
    names += [f"{name}_{axis}_per_input_mm_mm" for name in mechanism.probes for axis in "xy"]
    make_out_folder(out)
    write_table(out / "convergence.csv", names, rows, digits=7)
    table = {f"mesh x {row[0]:g}": dict(zip(names[1:], row[1:], strict=True)) for row in rows}
    click.echo(json.dumps(table, indent=2) if as_json else figures_text(mechanism.name, table, digits=6, least=36))


def _refuse_what_is_not_computed(mechanism: Mechanism, kind: str, asked: MotionAsked) -> None:
    """Refuse requests for which the drawing or the kind of model has no answer, before anything is computed."""
    if kind == "stiffness_matrix" and asked.moves:
        raise UsageError(
            "The model kind stiffness_matrix has no masses and cannot compute motion: choose --kind lumped or "
            "finite_element."
        )
    if asked.band is not None and not mechanism.probes:
        raise UsageError(
            f"--frequency needs a point whose motion is computed, but {mechanism.name} has none: add a [[probe]]."
        )


def _curve(states: Sequence[MechanismState]) -> PchipInterpolator:
    """Lengths and force over the input, in the column order of the dynamic response; contacts may cause kinks."""
    rows = [
        [*state.pairs_mm.values(), *(part for probe in state.probes_mm.values() for part in probe), state.force_n]
        for state in states
    ]
    return PchipInterpolator([state.input_mm for state in states], rows)
