"""`fingervision model mechanism.toml`: any planar mechanism by finite elements."""

import json
from pathlib import Path
from typing import Any

import click
import numpy as np
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.models.mechanism_plate import MechanismPlate, MechanismState
from fingervision.storage.mechanism_toml import read_mechanism

_ROWS = 21
_OF_YIELD = 0.5
"""Without a drive, inputs up to half of what makes the flexures yield are answered, either way."""


def predict(
    path: Path,
    kind: str,
    drive: Path | None,
    columns: Path | None,
    out: Path,
    *,
    large_rotation: bool,
    contact: bool,
    mesh: bool,
    as_json: bool,
) -> None:
    """Write mechanism.csv (and simulation.csv where a pair is called gap), deformed.png, and print the figures."""
    from fingervision.cli._model_figures import draw_mesh
    from fingervision.tables.read import read_drive

    mechanism = read_mechanism(path)
    if kind not in ("all", "finite_element"):
        raise UsageError(
            f"--kind must be finite_element for a mechanism drawn by bodies, but is {kind}, which knows the gripper's "
            "chain of links alone."
        )
    if contact:
        raise UsageError("--contact is known for grippers alone; leave it out for a mechanism drawn by bodies.")
    model = MechanismPlate(mechanism)
    unit = model.state(1.0)
    at_yield_mm = mechanism.material.yield_mpa / unit.stress_mpa
    if drive is None:
        inputs = np.linspace(-_OF_YIELD, _OF_YIELD, _ROWS) * at_yield_mm
    else:
        inputs = np.unique(read_drive(drive, columns).input_mm)
    states = [model.state(float(value), large_rotation=large_rotation) for value in inputs]
    figures = _figures(model, unit, at_yield_mm)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FingervisionError(f"--out must be a folder that can be written, but {out}: {error.strerror}.") from error
    _write(states, out)
    _draw(model, max(states, key=lambda state: abs(state.input_mm)), out / "deformed.png", large=large_rotation)
    if mesh:
        draw_mesh(model.mesh, mechanism.name, out / "mesh.png")
    if as_json:
        click.echo(json.dumps({"finite_element": figures}, indent=2))
    else:
        click.echo(mechanism.name)
        for name, value in figures.items():
            click.echo(f"{name:<44}{value:>14.6g}")
    worst = max(states, key=lambda state: state.stress_mpa)
    if worst.stress_mpa > mechanism.material.yield_mpa:
        click.echo(
            f"Warning: at an input of {worst.input_mm:.3g} mm the stress in the flexures must stay below the yield of "
            f"{mechanism.material.yield_mpa:g} MPa, but is {worst.stress_mpa:.3g} MPa; stay within "
            f"{at_yield_mm:.3g} mm.",
            err=True,
        )


def _figures(model: MechanismPlate, unit: MechanismState, at_yield_mm: float) -> dict[str, float]:
    figures = {
        "input_stiffness_n_mm": model.stiffness_n_mm,
        "peak_stress_mpa_per_mm": unit.stress_mpa,
        "input_at_yield_mm": at_yield_mm,
    }
    for name, (x, y) in unit.probes_mm.items():
        figures[f"{name}: x per input [mm/mm]"] = x
        figures[f"{name}: y per input [mm/mm]"] = y
    rest = model.state(0.0).pairs_mm
    for name, value in unit.pairs_mm.items():
        figures[f"{name}: at rest [mm]"] = rest[name]
        figures[f"{name}: per input [mm/mm]"] = value - rest[name]
    for held, label in ((False, "drive_free"), (True, "drive_held")):
        for place, value in enumerate(model.modes_hz(drive_held=held), 1):
            figures[f"mode_{place}_{label}_hz"] = value
    return figures | {"model_error_force_percent": 100.0 * model.force_error}


def _write(states: list[MechanismState], out: Path) -> None:
    columns: dict[str, list[float]] = {"input_mm": [s.input_mm for s in states], "force_n": [s.force_n for s in states]}
    for name in states[0].probes_mm:
        for place, axis in enumerate("xy"):
            columns[f"{name}_{axis}_mm"] = [s.probes_mm[name][place] for s in states]
    for name in states[0].pairs_mm:
        columns[f"{name}_mm"] = [s.pairs_mm[name] for s in states]
    columns["stress_mpa"] = [s.stress_mpa for s in states]
    _table(columns, out / "mechanism.csv")
    if "gap" in states[0].pairs_mm:
        table = {"input_mm": columns["input_mm"], "gap_mm": columns["gap_mm"], "force_n": columns["force_n"]}
        _table(table, out / "simulation.csv")


def _table(columns: dict[str, list[float]], path: Path) -> None:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _draw(model: MechanismPlate, state: MechanismState, path: Path, *, large: bool) -> None:
    plate = model.plate
    corners: Any = plate.corner_triangles
    moved: NDArray[np.float64] = state.displacement_mm
    stress = plate.at_corners(plate.von_mises_mpa(moved, large=large))
    count = stress.size
    x, y = plate.nodes_mm[:, :count]
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    axes = figure.add_subplot()
    axes.triplot(Triangulation(x, y, corners.T), color="0.9", linewidth=0.2)
    shape = Triangulation(x + moved[plate.x_dofs[:count]], y + moved[plate.y_dofs[:count]], corners.T)
    top = max(state.stress_mpa, 1e-9)
    colours = axes.tripcolor(shape, stress, shading="gouraud", cmap="viridis", vmin=0.0, vmax=top)
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    axes.set_title(
        f"{model.mechanism.name}: input {state.input_mm:.3g} mm, to scale, force {state.force_n:.3g} N\n"
        f"largest stress in a flexure {state.stress_mpa:.3g} MPa (yield {model.mechanism.material.yield_mpa:g} MPa)"
    )
    figure.colorbar(colours, ax=axes, label="von Mises stress / MPa", shrink=0.8)
    figure.savefig(path, dpi=130)
