"""`fingervision model`: predict the behaviour of a gripper or mechanism from its drawing."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fingervision.cli._command import CLOCK, FILE, MODEL, NUMBER, OUTPUT, KindName, make_command, option
from fingervision.cli._options import columns_option, json_option, out_option, results_folder

if TYPE_CHECKING:
    from fingervision.domain.gripper import Gripper
    from fingervision.interface.prediction import GripperPrediction

_SWEPT = ("convergence.csv", "vary.csv", "vary.png", "solve.csv", "vary.svg", "vary.pdf")
_PREDICTED = (
    *(f"{name}.{ending}" for ending in ("svg", "pdf") for name in (
        "models", "deformed", "mesh", "modes", "frequency", "grip", "response", "uncertainty",
    )),
    "models.csv", "models.png", "simulation.csv", "mechanism.csv", "deformed.png", "mesh.png", "modes.csv", "modes.png",
    "frequency.csv", "frequency.png", "grip.csv", "grip.png", "response.csv", "response.png", "uncertainty.csv",
    "uncertainty.png", "modes.mp4",
)  # fmt: skip
"""Names of the result files of the two kinds of call."""
ASKED = "What is computed"
"""Group of the help."""
_EPILOG = """\b
Examples:
  fingervision model gripper.toml --kind all --drive drive.csv --out model
  fingervision model gripper.toml --kind finite_element --large-rotation --contact --mesh --out model
  fingervision model gripper.toml --kind lumped --vary hinge.thickness_mm=0.6:1.4:9
  fingervision model gripper.toml --kind lumped --drive drive.csv --damping paper --rate-hz 2000
  fingervision model gripper.toml --kind lumped --object-mm 3 --object-n-mm 50
  fingervision model gripper.toml --kind lumped --frequency 1:500 --modes 500Hz --film
  fingervision model mechanism.toml --vary lengths.t=0.2:0.4:5
  fingervision model gripper.toml --solve lever.l2_mm=16:20 --for gap_per_input=8
  fingervision model mechanism.toml --large-rotation --mesh --out stage
  fingervision model gripper.toml --export gripper.svg --export gripper.stl
"""


@make_command(_EPILOG)
@click.argument("gripper_toml", metavar="DRAWING", type=FILE)
@option(
    "--layer",
    metavar="NAME",
    default="",
    group=MODEL,
    help="Layer of a DXF file from which a drawing is begun; all visible ones by default.",
)
@option(
    "--unit-mm",
    type=NUMBER,
    group=MODEL,
    help="Length in mm of the unit of a DXF or SVG file from which a drawing is begun; as the file states by default.",
)
@option(
    "--kind",
    type=KindName("all"),
    default="all",
    show_default=True,
    group=MODEL,
    help="Kind of model by which the drawing is computed.",
)
@option(
    "--hinge",
    type=click.Choice(["corrected", "beam"]),
    default="corrected",
    show_default=True,
    group=MODEL,
    help="Hinge compliance of a gripper.toml: beam theory corrected by finite elements, or beam theory alone.",
)
@option(
    "--large-rotation",
    is_flag=True,
    group=MODEL,
    help="Compute the equilibrium in the deformed shape (not with stiffness_matrix).",
)
@option(
    "--contact",
    is_flag=True,
    group=MODEL,
    help="Stop the fingers where they touch each other (not with stiffness_matrix).",
)
@option(
    "--vary",
    multiple=True,
    metavar="NAME=A:B:N",
    group=ASKED,
    help="Vary one number of the drawing over N values from A to B (repeatable: a grid); write vary.csv and vary.png, "
    "computed by the lumped model.",
)
@option(
    "--solve",
    multiple=True,
    metavar="NAME[=A:B]",
    group=ASKED,
    help="Find the value between A and B of a number of the drawing for which a figure takes the value of --for; write "
    "solve.csv (repeatable).",
)
@option(
    "--for",
    "wanted",
    multiple=True,
    metavar="FIGURE=VALUE",
    group=ASKED,
    help="With --solve: wanted value of a figure of models.csv, such as gap_per_input=8; one for each --solve.",
)
@option(
    "--modes",
    metavar="N|F",
    group=ASKED,
    help="Compute and plot N natural modes of each family, or all up to a frequency such as 500Hz.",
)
@option("--film", is_flag=True, group=ASKED, help="With --modes: also write modes.mp4, a film of the mode shapes.")
@option(
    "--frequency",
    metavar="A:B",
    group=ASKED,
    help="Compute the response to a drive that vibrates at A to B Hz: frequency.csv and frequency.png.",
)
@option(
    "--damping",
    default="modal:0.025",
    show_default=True,
    metavar="LAW",
    group=ASKED,
    help="Damping law of vibrations: modal:RATIO, loss:FACTOR, rayleigh:RATIO:HZ:HZ or paper[:GAMMA] (equation 4 of "
    "Hricko and Havlik, 2015, above the lowest mode).",
)
@option(
    "--object-mm",
    type=NUMBER,
    group=ASKED,
    help="Width (mm) of a part to grip between the fingers or a pair of probes: grip.csv and grip.png.",
)
@option(
    "--object-n-mm",
    type=NUMBER,
    group=ASKED,
    help="With --object-mm: stiffness of the part in N/mm; a rigid part if not given.",
)
@option(
    "--drive",
    type=FILE,
    group=CLOCK,
    help="Log of the stage (drive.csv or another table), for which the response over time is computed.",
)
@columns_option
@option(
    "--rate-hz",
    type=NUMBER,
    group=CLOCK,
    help="Rows per second of response.csv, in addition to the drive's own samples.",
)
@out_option("model")
@option(
    "--export",
    multiple=True,
    type=FILE,
    metavar="FILE",
    group=OUTPUT,
    help="Write the outline as .dxf or .svg, or the plate as .stl (mm), and compute nothing (repeatable).",
)
@option(
    "--convergence",
    is_flag=True,
    group=ASKED,
    help="Compute finite elements on meshes of four sizes only, and write convergence.csv.",
)
@option(
    "--magnify",
    type=NUMBER,
    default=1.0,
    show_default=True,
    group=OUTPUT,
    help="Factor by which displacements are drawn larger in deformed.png.",
)
@option(
    "--colour",
    type=click.Choice(["stress", "displacement"]),
    default="stress",
    show_default=True,
    group=OUTPUT,
    help="Colour of the bodies in deformed.png.",
)
@option("--vector", is_flag=True, group=OUTPUT, help="Write every figure for a paper too, as .svg and .pdf.")
@option("--mesh", is_flag=True, group=OUTPUT, help="Write a picture of the finite-element mesh, mesh.png.")
@json_option("Print the table as JSON.")
def command(
    gripper_toml: Path,
    layer: str,
    unit_mm: float | None,
    kind: str,
    drive: Path | None,
    columns: Path | None,
    out: Path,
    hinge: str,
    large_rotation: bool,
    contact: bool,
    modes: str | None,
    film: bool,
    frequency: str | None,
    damping: str,
    rate_hz: float | None,
    object_mm: float | None,
    object_n_mm: float | None,
    export: tuple[Path, ...],
    convergence: bool,
    magnify: float,
    colour: str,
    vector: bool,
    mesh: bool,
    vary: tuple[str, ...],
    solve: tuple[str, ...],
    wanted: tuple[str, ...],
    as_json: bool,
) -> None:
    """Predict gap, force, stress and vibration from a drawing, with one kind of model or all kinds.

    The command writes models.csv, simulation.csv (in a folder per model with --kind all), models.png (the gap over the
    input, with differences between the models) and deformed.png (with finite elements). With --drive, it also writes
    response.csv (gap and force over the drive's time, a table that compare and diagnose accept as measured) and
    response.png. For a mechanism.toml, the results over the input are in mechanism.csv.

    From the outline of a DXF or SVG file, the command begins a mechanism.toml, with the lines that are to be completed.
    Its thin strips and notches are flexures.
    """
    import json

    import numpy as np

    from fingervision.cli._model_grip import part_asked, write_grip
    from fingervision.cli._model_motion import motion_asked, move
    from fingervision.cli._model_report import say_refusals, say_what_limits, say_width
    from fingervision.domain.errors import UsageError
    from fingervision.interface.prediction import figures_csv, figures_text, predict_gripper, refuse_beams
    from fingervision.models.answer_figures import Physics
    from fingervision.models.hinge_correction import HingeTheory
    from fingervision.models.kinds import by_trust, kinds
    from fingervision.storage.gripper_toml import read_gripper
    from fingervision.storage.mechanism_toml import is_mechanism
    from fingervision.storage.out_folder import began_in, finish_in, make_out_folder
    from fingervision.tables.read import read_drive

    if not magnify > 0.0:
        raise UsageError(f"--magnify must be a positive factor, but is {magnify:g}.")
    del colour, vector  # read where figures are drawn (`FigureStyle`)
    if (layer or unit_mm is not None) and gripper_toml.suffix.lower() not in (".dxf", ".svg"):
        raise UsageError(
            f"--layer and --unit-mm must stand beside a .dxf or .svg file, but {gripper_toml} is none: state layer and "
            "unit_mm in its [[body]]."
        )
    asked = motion_asked(drive, columns, modes, frequency, damping, rate_hz, film=film)
    if export or gripper_toml.suffix.lower() in (".dxf", ".svg"):
        from fingervision.cli import _outline

        if export:
            _outline.export(gripper_toml, export)
        else:
            _outline.begin_drawing(gripper_toml, results_folder(out, gripper_toml), layer, unit_mm)
        return
    out = results_folder(out, gripper_toml)
    began_ns = began_in(out)
    if convergence:
        from fingervision.cli._mechanism import write_convergence
        from fingervision.models.gripper_mechanism import half_mechanism
        from fingervision.storage.mechanism_toml import read_mechanism

        drawn = is_mechanism(gripper_toml)
        mechanism = read_mechanism(gripper_toml) if drawn else half_mechanism(read_gripper(gripper_toml))
        write_convergence(mechanism, out, as_json=as_json)
        finish_in(out, gripper_toml, _SWEPT, began_ns)
        return
    if is_mechanism(gripper_toml):
        from fingervision.cli._mechanism import predict

        refuse_beams(gripper_toml, HingeTheory(hinge))
        predict(
            gripper_toml, kind, drive, columns, out, asked, vary, (solve, wanted),
            object_mm=object_mm, object_n_mm=object_n_mm, large_rotation=large_rotation, contact=contact, mesh=mesh,
            as_json=as_json,
        )  # fmt: skip
        finish_in(out, gripper_toml, _SWEPT if vary or solve or wanted else _PREDICTED, began_ns)
        return
    gripper = read_gripper(gripper_toml)
    part = part_asked(object_mm, object_n_mm, gripper.body.rest_gap_mm)
    if solve or wanted:
        from fingervision.cli._model_sweep import solve as solve_gripper

        solve_gripper(gripper, solve, wanted, out, as_json=as_json)
        finish_in(out, gripper_toml, _SWEPT, began_ns)
        return
    if vary:
        from fingervision.cli._model_sweep import sweep

        sweep(gripper, gripper_toml.stem, vary, HingeTheory(hinge), out, as_json=as_json)
        finish_in(out, gripper_toml, _SWEPT, began_ns)
        return
    if uncertain := any(u > 0.0 for u in gripper.uncertainties.values()):
        from fingervision.models.uncertainty import check_uncertainties

        check_uncertainties(gripper)
    physics = Physics(large_rotation=large_rotation, contact=contact)
    inputs = None if drive is None else np.unique(read_drive(drive, columns).input_mm)
    make_out_folder(out)
    found = predict_gripper(gripper_toml, gripper, kind, inputs, physics, HingeTheory(hinge))
    models, rows, figures, inputs = found.models, found.figures, found.stated, found.input_mm
    folders = {name: out / name if kind == "all" else out for name in models}
    say_refusals(found.refusals)
    for name, folder in folders.items():
        found.write(name, folder)
    _draw(gripper_toml.stem, gripper, found, out, mesh=mesh)
    (out / "models.csv").write_text(figures_csv(rows), encoding="utf-8")
    click.echo(json.dumps(rows, indent=2) if as_json else figures_text("", rows))
    if not as_json:
        say_width(gripper.body.plate_mm, rows[by_trust(rows)[0]])
    if uncertain:
        from fingervision.cli._model_sweep import write_uncertainty
        from fingervision.models.uncertainty import gripper_uncertainty

        across = any(row["first_out_of_plane_mode_hz"] is not None for row in rows.values())
        spread = gripper_uncertainty(gripper, inputs, HingeTheory(hinge), physics, across_plane=across)
        write_uncertainty(spread, rows, gripper_toml.stem, out, as_json=as_json)
    move(models, asked, gripper_toml.stem, folders, out, as_json=as_json)
    if part is not None:
        given_inputs = None if drive is None else inputs
        errors = {name: figures[name].grip_error for name in models}
        write_grip(gripper, models, part, given_inputs, gripper_toml.stem, out, errors=errors, as_json=as_json)
    finish_in(
        out,
        gripper_toml,
        (*_PREDICTED, *(f"{each}/{name}.csv" for each in kinds() for name in ("simulation", "response"))),
        began_ns,
    )
    for sentence in found.warnings:
        click.echo(f"Warning: {sentence}", err=True)
    say_what_limits(gripper, models, figures, inputs, physics, as_json=as_json)


def _draw(name: str, gripper: "Gripper", found: "GripperPrediction", out: Path, *, mesh: bool) -> None:
    from fingervision.cli._model_figures import draw_comparison, draw_deformed, draw_mesh
    from fingervision.models.reference_mesh import is_reference

    model = next((model for model in found.models.values() if hasattr(model, "mesh")), None)
    if model is not None:
        draw_deformed(model, float(found.input_mm[abs(found.input_mm).argmax()]), name, out / "deformed.png")
        if mesh:
            draw_mesh(model.mesh, name, out / "mesh.png")
    elif mesh:
        click.echo("--mesh draws the mesh of the finite elements: add --kind finite_element.", err=True)
    draw_comparison(found.tables, name, out / "models.png", with_published=is_reference(gripper))
