"""The table of the `model` command, and the sentences about what limits its answers."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import ModelFigures
from fingervision.models.notch import notches_of
from fingervision.models.physics import Physics
from fingervision.models.yield_limit import input_at_yield_mm, opening_at_yield_mm

_UNITS = {"gap_per_input": "mm/mm", "seconds": "s", "peak_stress_mpa_per_mm": "MPa/mm", "input_stiffness_n_mm": "N/mm"}
_TRUST = ("finite_element", "lumped")


def loaded_rows(
    gripper: Gripper, model: Any, figures: ModelFigures, inputs: NDArray[np.float64]
) -> dict[str, float | None]:
    """Return one kind's column: small displacements at rest, and the loads at both ends of the inputs."""
    peak = figures.peak_stress
    row: dict[str, float | None] = {
        "gap_per_input": figures.gap_per_input,
        "input_stiffness_n_mm": figures.input_stiffness_n_mm,
        "peak_stress_mpa_per_mm": None if peak is None else peak.mpa_per_mm,
        "peak_x_mm": None if peak is None else peak.place_mm[0],
        "peak_y_mm": None if peak is None else peak.place_mm[1],
        "input_at_yield_mm": None if peak is None else opening_at_yield_mm(model, gripper.material.yield_mpa),
        "first_mode_drive_free_hz": next(iter(figures.free_modes_hz), None),
        "first_mode_drive_held_hz": next(iter(figures.locked_modes_hz), None),
        "first_swaying_mode_hz": next(iter(figures.swaying_modes_hz), None),
        "first_out_of_plane_mode_hz": next(iter(figures.out_of_plane_modes_hz), None),
        "contact_input_mm": figures.contact_input_mm,
    }
    ends = [float(inputs.min()), float(inputs.max())]
    if peak is not None:
        states = model.loaded(ends)
        loads = [(s.input_mm, s.gap_mm, s.force_n, s.grip_n, s.stress_mpa) for s in states]
    else:
        answer = model.respond(np.array(ends))
        loads = [(ends[i], float(answer.gap_mm[i]), float(answer.force_n[i]), None, None) for i in (0, 1)]
    for end, load in zip(("lowest", "highest"), loads, strict=True):
        names = (f"{end}_input_mm", f"{end}_gap_mm", f"{end}_force_n", f"{end}_grip_n", f"{end}_stress_mpa")
        row |= dict(zip(names, load, strict=True))
    row |= {
        "model_error_slope_percent": 100.0 * figures.slope_error,
        "model_error_force_percent": 100.0 * figures.force_error,
        "model_error_modes_percent": 100.0 * figures.mode_error if figures.free_modes_hz else None,
        "model_error_out_of_plane_percent": 100.0 * figures.out_of_plane_error
        if figures.out_of_plane_modes_hz
        else None,
    }
    return row


def write_table(rows: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Write models.csv: one line a kind, empty where a kind knows nothing."""
    names = list(next(iter(rows.values())))
    lines = [",".join(["kind", *names])]
    lines += [",".join([kind, *(_cell(row[name]) for name in names)]) for kind, row in rows.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.7g}"


def print_table(rows: Mapping[str, Mapping[str, Any]], *, as_json: bool) -> None:
    """Print one row a figure, one column a kind."""
    import json

    if as_json:
        click.echo(json.dumps(rows, indent=2))
        return
    names = list(next(iter(rows.values())))
    labels = {name: f"{name} [{_UNITS[name]}]" if name in _UNITS else name for name in names}
    width = max(len(label) for label in labels.values())
    click.echo(" " * width + "".join(f"{kind:>18}" for kind in rows))
    for name in names:
        cells = ("-" if row[name] is None else f"{row[name]:.5g}" for row in rows.values())
        click.echo(f"{labels[name]:<{width}}" + "".join(f"{cell:>18}" for cell in cells))


def say_what_limits(
    gripper: Gripper,
    models: Mapping[str, Any],
    figures: Mapping[str, ModelFigures],
    inputs: NDArray[np.float64],
    physics: Physics,
    *,
    as_json: bool,
) -> None:
    """Warn of stress beyond the yield, of fingers that pass through each other, and of what a kind does not have."""
    for kind in _TRUST:
        if kind in models:
            _warn_of_stress(gripper, models[kind], inputs)
            onset = figures[kind].contact_input_mm
            if onset is not None and not physics.contact and inputs.min() < onset * (1.0 + 1e-9):
                click.echo(
                    f"Warning: the fingers touch at an input of {onset:.4g} mm, and from there to {inputs.min():.4g} "
                    "mm this answer lets them pass through each other; add --contact.",
                    err=True,
                )
            break
    if "stiffness_matrix" in figures and not as_json:
        if len(models) > 1 and physics != Physics():
            click.echo("Note: stiffness_matrix answers by small displacements and without contact all the same.")
        click.echo(_out_of_plane_limit(gripper, figures["stiffness_matrix"]))


def _out_of_plane_limit(gripper: Gripper, figures: ModelFigures) -> str:
    wide = max(notch.plate_mm / notch.thickness_mm for notch in notches_of(gripper))
    return (
        f"Note: the first mode out of the plane takes bars for joined at points, which makes it up to "
        f"{100.0 * figures.out_of_plane_error:.2g} % too high; the hinges' torsion at width over thickness {wide:.3g} "
        "is that of bricks between rigid planes."
    )


def _warn_of_stress(gripper: Gripper, model: Any, inputs: NDArray[np.float64]) -> None:
    limit = gripper.material.yield_mpa
    states = [s for s in model.loaded([float(inputs.min()), float(inputs.max())]) if s.stress_mpa > limit]
    for state in states:
        click.echo(
            f"Warning: at an input of {state.input_mm:.3g} mm the stress at ({state.place_mm[0]:.4g}, "
            f"{state.place_mm[1]:.4g}) must stay below the yield of {limit:g} MPa, but is {state.stress_mpa:.3g} MPa, "
            f"{state.stress_mpa - limit:.3g} MPa too much; stay within "
            f"{input_at_yield_mm(model, state.input_mm, limit):.3g} mm.",
            err=True,
        )
