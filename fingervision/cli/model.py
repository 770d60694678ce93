"""Predict a gripper from its drawing: `fingervision model`."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fingervision.domain.gripper import Gripper
    from fingervision.domain.response import Response
    from fingervision.models.answer_figures import ModelFigures

_KINDS = ("stiffness_matrix", "lumped", "finite_element", "all")
_METRES_BELOW_OF_HEIGHT = 1e-4
_MOST_ROWS = 401
_EPILOG = """\b
Examples:
  fingervision model gripper.toml --kind all --drive drive.csv --out model
  fingervision model gripper.toml --kind finite_element --large-rotation --contact --out model
  fingervision model gripper.toml --kind lumped --hinge beam --json
"""


@click.command(epilog=_EPILOG)
@click.argument("gripper_toml", metavar="GRIPPER.toml", type=click.Path(path_type=Path))
@click.option("--kind", type=click.Choice(_KINDS), default="all", show_default=True, help="Which model.")
@click.option("--drive", type=click.Path(path_type=Path), help="drive.csv with the inputs to answer.")
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("model"), show_default=True, help="Folder to write."
)
@click.option("--hinge", type=click.Choice(["corrected", "beam"]), default="corrected", show_default=True,
              help="Hinge compliance: beam theory corrected by finite elements, or beam theory alone.")  # fmt: skip
@click.option("--large-rotation", is_flag=True, help="Equilibrium in the deformed shape (not for stiffness_matrix).")
@click.option("--contact", is_flag=True, help="Fingers touch and stop (not for stiffness_matrix).")
@click.option("--json", "as_json", is_flag=True, help="Print the table as JSON.")
def command(
    gripper_toml: Path,
    kind: str,
    drive: Path | None,
    out: Path,
    hinge: str,
    large_rotation: bool,
    contact: bool,
    as_json: bool,
) -> None:
    """Predict gap, force, stress and vibration from a drawing, by one model or all of them.

    Writes models.csv, simulation.csv (in a folder per model with --kind all), models.png (the paper's Figure 9, with
    differences) and deformed.png (with finite elements).
    """
    from fingervision.models.hinge_correction import HingeTheory
    from fingervision.models.kinds import build_model, kinds
    from fingervision.models.physics import LINEAR, Physics
    from fingervision.storage.gripper_toml import read_gripper
    from fingervision.storage.simulation_csv import write_simulation

    gripper = read_gripper(gripper_toml)
    wanted = kinds() if kind == "all" else (kind,)
    physics = Physics(large_rotation=large_rotation, contact=contact)
    given = None if drive is None else _inputs_mm(drive, gripper)
    _make_folder(out)
    rows: dict[str, dict[str, Any]] = {}
    answers: dict[str, Response] = {}
    inputs = given
    for name in wanted:
        began = time.perf_counter()
        own = LINEAR if name == "stiffness_matrix" and kind == "all" else physics
        model = build_model(name, gripper, own, HingeTheory(hinge))
        figures = model.figures()
        if inputs is None:
            inputs = _inputs_until_touch(figures)
        answers[name] = model.respond(inputs)
        rows[name] = {**_row(gripper, figures), "seconds": round(time.perf_counter() - began, 3)}
        folder = out / name if kind == "all" else out
        folder.mkdir(exist_ok=True)
        write_simulation(folder / "simulation.csv", inputs, answers[name])
        if name == "finite_element":
            _draw_body(model, inputs, out / "deformed.png")
        if name == "finite_element" or kind != "all":
            _warn_of_stress(gripper, figures, inputs)
    if inputs is not None:
        _draw_models(gripper, inputs, answers, out / "models.png")
    _write_table(rows, out / "models.csv")
    _print_table(rows, as_json=as_json)


def _make_folder(out: Path) -> None:
    from fingervision.domain.errors import FingervisionError

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FingervisionError(
            f"--out must be a folder that can be written, but {out} is not: {error.strerror}."
        ) from error


def _inputs_mm(drive: Path, gripper: "Gripper") -> "NDArray[np.float64]":
    import numpy as np

    from fingervision.domain.errors import UsageError
    from fingervision.storage.drive_csv import read_drive

    inputs = np.unique(read_drive(drive).input_mm)
    largest = float(np.abs(inputs).max())
    if 0.0 < largest < _METRES_BELOW_OF_HEIGHT * gripper.body.height_mm:
        raise UsageError(
            f"The inputs of {drive} must be millimetres, but the largest is {largest:g} for a gripper of "
            f"{gripper.body.height_mm:g} mm: are they metres? Multiply the column by 1000."
        )
    if largest > gripper.body.height_mm:
        raise UsageError(
            f"The inputs of {drive} must be millimetres, but the largest is {largest:g} for a gripper of "
            f"{gripper.body.height_mm:g} mm: are they micrometres? Divide the column by 1000."
        )
    if inputs.size < 2:
        raise UsageError(f"The drive {drive} must hold at least two different inputs, but holds {inputs.size}.")
    return inputs if inputs.size <= _MOST_ROWS else np.linspace(inputs[0], inputs[-1], _MOST_ROWS)


def _inputs_until_touch(figures: "ModelFigures") -> "NDArray[np.float64]":
    """Inputs from the first touch to three times as far the other way: the paper's own range."""
    import numpy as np

    touch = figures.contact_input_mm or -0.1
    return np.union1d(np.linspace(touch, 0.0, 26), np.linspace(0.0, -3.0 * touch, 76))


def _row(gripper: "Gripper", figures: "ModelFigures") -> dict[str, Any]:
    peak = figures.peak_stress
    travel = None if peak is None else gripper.material.yield_mpa / peak.mpa_per_mm
    return {
        "gap_per_input": figures.gap_per_input,
        "input_stiffness_n_mm": figures.input_stiffness_n_mm,
        "peak_stress_mpa_per_mm": None if peak is None else peak.mpa_per_mm,
        "peak_x_mm": None if peak is None else peak.place_mm[0],
        "peak_y_mm": None if peak is None else peak.place_mm[1],
        "input_at_yield_mm": travel,
        "first_mode_drive_free_hz": figures.free_modes_hz[0] if figures.free_modes_hz else None,
        "first_mode_drive_held_hz": figures.locked_modes_hz[0] if figures.locked_modes_hz else None,
        "first_swaying_mode_hz": figures.swaying_modes_hz[0] if figures.swaying_modes_hz else None,
        "first_out_of_plane_mode_hz": figures.out_of_plane_modes_hz[0] if figures.out_of_plane_modes_hz else None,
        "contact_input_mm": figures.contact_input_mm,
    }


def _draw_body(model: Any, inputs: "NDArray[np.float64]", path: Path) -> None:
    from fingervision.cli._model_figures import draw_deformed

    draw_deformed(model, float(inputs.max()) if inputs.max() > 0.0 else float(inputs.min()), path)


def _draw_models(gripper: "Gripper", inputs: "NDArray[np.float64]", answers: "dict[str, Response]", path: Path) -> None:
    from fingervision.cli._model_figures import draw_comparison
    from fingervision.models.reference_mesh import is_reference

    draw_comparison(inputs, answers, path, with_published=is_reference(gripper))


def _warn_of_stress(gripper: "Gripper", figures: "ModelFigures", inputs: "NDArray[np.float64]") -> None:
    import numpy as np

    peak = figures.peak_stress
    if peak is None:
        return
    largest = float(np.abs(inputs).max())
    stress = peak.mpa_per_mm * largest
    limit = gripper.material.yield_mpa
    if stress > limit:
        click.echo(
            f"Warning: at an input of {largest:.3g} mm the stress at ({peak.place_mm[0]:.4g}, {peak.place_mm[1]:.4g}) "
            f"must stay below the yield of {limit:g} MPa, but is {stress:.3g} MPa, {stress - limit:.3g} MPa too much; "
            f"stay within {limit / peak.mpa_per_mm:.3g} mm.",
            err=True,
        )


def _write_table(rows: dict[str, dict[str, Any]], path: Path) -> None:
    names = list(next(iter(rows.values())))
    lines = [",".join(["kind", *names])]
    lines += [",".join([kind, *(_cell(row[name]) for name in names)]) for kind, row in rows.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.7g}"


def _print_table(rows: dict[str, dict[str, Any]], *, as_json: bool) -> None:
    import json

    if as_json:
        click.echo(json.dumps(rows, indent=2))
        return
    width = max(len(name) for name in next(iter(rows.values())))
    click.echo(" " * width + "".join(f"{kind:>18}" for kind in rows))
    for name in next(iter(rows.values())):
        cells = ("-" if row[name] is None else f"{row[name]:.5g}" for row in rows.values())
        click.echo(f"{name:<{width}}" + "".join(f"{cell:>18}" for cell in cells))
