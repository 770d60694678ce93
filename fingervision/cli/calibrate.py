"""`fingervision calibrate`: scale in pixels per millimetre from a reference object, with an uncertainty budget."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from fingervision.cli._command import FILE, NUMBER, OUTPUT, Group, option, together
from fingervision.cli._options import (
    json_option,
    named_references,
    out_option,
    region_from,
    response_option,
    roi_option,
)
from fingervision.domain.errors import DataError, UsageError

BAR_EXAMPLES = """
\b
Examples:
  fingervision calibrate bar ref5.png=5.000 ref11.png=11.000 ref17.png=17.000 -o calibration.json
  fingervision calibrate bar ref5.png=5.000 slot:ref3.png=3.000 --u-size-mm 0.0005 --plane-mm 0.2
"""
SLOT_EXAMPLES = """
\b
Example:
  fingervision calibrate slot ref3.png=3.000 bar:ref5.png=5.000 -o calibration.json
"""
CHESSBOARD_EXAMPLES = """
\b
Example:
  fingervision calibrate chessboard plane.png tilted*.png --squares 9x6 --square-mm 2.5 -o calibration.json
"""
CHARUCO_EXAMPLES = """
\b
Example:
  fingervision calibrate charuco charuco_plane.png charuco_tilted*.png --squares 8x6 --square-mm 3 --marker-mm 2.2
"""
RESPONSE_EXAMPLES = """
\b
Examples:
  fingervision calibrate response e05.png=0.5 e10.png=1 e20.png=2 e40.png=4 -o response.csv
  fingervision calibrate response --densities 0.05:1.95:0.1 --roi 40,200,560,60 wedge.png
  fingervision calibrate response --edges bar1.png bar2.png bar3.png
  fingervision measure opening.mp4 --calibration calibration.json --response response.csv
"""
SCALE_EXAMPLES = """
\b
Examples:
  fingervision calibrate scale micrometer.png --pitch-mm 0.1 -o calibration.json
  fingervision calibrate scale micrometer.png --pitch-mm 0.1 --roi 0,60,640,180 --u-length-mm 0.0005
"""
CHECK_EXAMPLES = """
\b
Example:
  fingervision calibrate check calibration.json object.png=8.000 --u-size-mm 0.001
"""
REPEAT_EXAMPLES = """
\b
Examples:
  fingervision calibrate repeat monday/gaps.csv tuesday/gaps.csv wednesday/gaps.csv --tolerance-mm 0.02
  fingervision calibrate repeat a/gaps.csv b/gaps.csv --by-input
"""

GROUP_EXAMPLES = """
\b
Examples:
  fingervision calibrate bar ref5.png=5.000 slot:ref3.png=3.000 --u-size-mm 0.0005 --plane-mm 0.2
  fingervision calibrate check calibration.json object.png=8.000 --u-size-mm 0.001
"""


KINDS = (
    "bar or slot (objects or openings of known width), scale (a line scale), chessboard or charuco (a board; lens and "
    "tilt too), response (the camera's curve), check (of a calibration) or repeat (of recordings)"
)


@click.group("calibrate", cls=Group, epilog=GROUP_EXAMPLES, kinds=KINDS)
def command() -> None:
    """Calibrate pixels to millimetres from a reference of known size."""


REFERENCE, SETUP = "Reference", "Limits of the set-up"
"""Groups of the help."""
LIMITS = (
    ("--plane-mm", "plane_mm", 0.5, "Largest distance of the gripper from the plane of the reference, +- mm."),
    (
        "--camera-distance-mm",
        "camera_distance_mm",
        100.0,
        "Distance of the camera from the plane of the reference, mm.",
    ),
    ("--tilt-deg", "tilt_deg", 2.0, "Largest tilt of the plane, +- degrees."),
    (
        "--lens-relative",
        "lens_relative",
        0.001,
        "Largest residual lens distortion, +-, as a fraction of the distance from centre to corner.",
    ),
    (
        "--edge-bias-px",
        "edge_bias_px",
        0.6,
        "Largest edge bias (both edges together) if no reference determines it, +- px.",
    ),
    ("--estimator-px", "estimator_px", 0.02, "Largest sub-pixel phase bias of the fit of each edge, +- px."),
    (
        "--temperature-k",
        "temperature_k",
        2.0,
        "Largest deviation of the reference's temperature from its certificate's, +- K.",
    ),
    ("--expansion-per-k", "expansion_per_k", 11.5e-6, "Thermal expansion of the reference (steel), 1/K."),
)
"""What the uncertainty budget needs and no picture shows: option, name and default in calib.limits.Limits (a test
compares the defaults), description."""
_limit_options = together(
    *(
        option(flag, name, type=NUMBER, group=SETUP, help=f"{words}  [default: {default:g}]")
        for flag, name, default, words in LIMITS
    )
)
_output_options = together(
    option("--certificate", default="", group=REFERENCE, help="Name of the reference's certificate."),
    option("--date", default="", group=REFERENCE, help="Date of the certificate."),
    response_option("the pictures' own tag, else linear", SETUP),
    option(
        "--camera",
        multiple=True,
        metavar="NAME=VALUE",
        group=SETUP,
        help="A camera setting to record in the calibration; repeatable.",
    ),
    out_option("calibration.json", "File for the calibration.", FILE),
    option("--no-figure", is_flag=True, former=("--no-picture",), group=OUTPUT, help="Write no calibration picture."),
    json_option("Print the result as JSON."),
)
_size_options = together(
    click.argument("items", nargs=-1, required=True, metavar="IMAGE=SIZE_MM..."),
    option(
        "--u-size-mm",
        type=NUMBER,
        default=0.001,
        show_default=True,
        group=REFERENCE,
        help="Standard uncertainty of every size, mm.",
    ),
    roi_option("Use only this part of every picture."),
)
_board_options = together(
    click.argument("images", nargs=-1, required=True, metavar="IMAGE...", type=FILE),
    option("--square-mm", type=NUMBER, required=True, group=REFERENCE, help="Side of a square, mm."),
    option(
        "--u-square-mm",
        type=NUMBER,
        group=REFERENCE,
        help="Standard uncertainty of a square's side, mm.  [default: 0.1 % of it]",
    ),
)


def _calibrate(
    kind: str, pictures: Any, *, out: Path, camera: Sequence[str], no_figure: bool, as_json: bool, **options: Any
) -> None:
    """Call `fingervision.calibrate`, write its result and print it."""
    from fingervision.interface.calibrate import calibrate
    from fingervision.interface.calibration import as_json as for_programs
    from fingervision.storage.calibration_json import refuse_foreign

    refuse_foreign(out)
    if "roi" in options:
        options["roi"] = region_from(options["roi"])
    made = calibrate(kind, pictures, camera=_settings(camera), **options)
    made.save(out, pictures=not no_figure)
    if as_json:
        click.echo(json.dumps(for_programs(made.scale, {"out": str(out), **made.details})))
    else:
        click.echo(f"{made.report()}\n\nWritten: {out}")


def _settings(camera: Sequence[str]) -> dict[str, str]:
    settings = {}
    for setting in camera:
        name, equals, value = setting.partition("=")
        if not (name and equals):
            raise UsageError(f"--camera must be NAME=VALUE, but is {setting!r}.")
        settings[name] = value
    return settings


def _squares(squares: str) -> tuple[int, int]:
    try:
        columns, rows = (int(part) for part in squares.lower().split("x"))
    except ValueError:
        raise UsageError(f"--squares must be two whole numbers such as 9x6, but is {squares!r}.") from None
    return columns, rows


@command.command("bar", epilog=BAR_EXAMPLES)
@_size_options
@_limit_options
@_output_options
def bar(items: Sequence[str], **options: Any) -> None:
    """Calibrate on bars: objects with two parallel straight edges at a known distance.

    Each picture shows one object, in any direction; the object may extend beyond the picture. Objects of three
    different sizes determine scale and edge bias. Fewer sizes determine only the scale; the edge bias is then not
    corrected, and its limit enters the budget. To add slots, prefix an item: slot:ref3.png=3.000.
    """
    _calibrate("bar", named_references(items, "bar"), **options)


@command.command("slot", epilog=SLOT_EXAMPLES)
@_size_options
@_limit_options
@_output_options
def slot(items: Sequence[str], **options: Any) -> None:
    """Calibrate on slots: openings between two parallel straight edges at a known distance.

    All other options are as for `bar`. To add bars, prefix an item: bar:ref5.png=5.000.
    """
    _calibrate("slot", named_references(items, "slot"), **options)


@command.command("chessboard", epilog=CHESSBOARD_EXAMPLES)
@_board_options
@option(
    "--squares", required=True, metavar="9x6", group=REFERENCE, help="Inner corners: 9x6 for a board of 10x7 squares."
)
@_limit_options
@_output_options
def chessboard(images: Sequence[Path], squares: str, **options: Any) -> None:
    """Calibrate on a chessboard: lens and tilt from three pictures or more, only the plane from one picture.

    The first picture defines the plane in which distances are measured: put the board where the gripper moves. For the
    other pictures, tilt the board differently each time.
    """
    _calibrate("chessboard", list(images), squares=_squares(squares), **options)


@command.command("charuco", epilog=CHARUCO_EXAMPLES)
@_board_options
@option("--squares", required=True, metavar="8x6", group=REFERENCE, help="Squares along x and y.")
@option("--marker-mm", type=NUMBER, group=REFERENCE, help="Side of a marker, mm.  [default: 0.75 of a square]")
@_limit_options
@_output_options
def charuco(images: Sequence[Path], squares: str, **options: Any) -> None:
    """Calibrate on a ChArUco board, which may extend beyond the picture; its marker dictionary is recognised.

    All other options are as for `chessboard`, but --squares counts squares and not inner corners.
    """
    _calibrate("charuco", list(images), squares=_squares(squares), **options)


@command.command("scale", epilog=SCALE_EXAMPLES)
@click.argument("image", type=FILE)
@option("--pitch-mm", type=NUMBER, required=True, group=REFERENCE, help="Certified distance of neighbouring lines, mm.")
@option(
    "--u-line-mm",
    type=NUMBER,
    group=REFERENCE,
    default=0.0003,
    show_default=True,
    help="Standard uncertainty of every line's position, mm.",
)
@option(
    "--u-length-mm",
    type=NUMBER,
    group=REFERENCE,
    default=0.001,
    show_default=True,
    help="Standard uncertainty of the length over all lines, mm.",
)
@roi_option("Use only this part of the picture.")
@_limit_options
@_output_options
def scale(image: Path, **options: Any) -> None:
    """Calibrate on a line scale (stage micrometer) over all its lines, in any direction.

    The scale comes from the middles of the lines: blooming and the camera's response move the two edges of a line in
    opposite directions and therefore do not move its middle. The edge bias of a gap is therefore not corrected; its
    limit enters the budget.
    """
    _calibrate("scale", image, **options)


@command.command("response", epilog=RESPONSE_EXAMPLES)
@click.argument("items", nargs=-1, required=True, metavar="IMAGE[=EXPOSURE]...")
@option(
    "--edges",
    is_flag=True,
    help="Estimate the response from pictures of sharp, straight, plain edges that are not clipped.",
)
@option(
    "--densities",
    metavar="A:B:STEP|A,B,...",
    help="Measure the response on one picture of a grey wedge with these optical densities, lightest first.",
)
@roi_option("With --densities: region of the wedge's fields.")
@out_option("response.csv", "File for the response.", FILE)
@json_option("Print the result as JSON.")
def response(**options: Any) -> None:
    """Measure the camera's response (light for each grey level), best from a still scene at several exposures.

    For an exposure series, the scene needs flat parts of many shades (paper with grey fields). Change only the exposure
    time; leave aperture, light and focus unchanged. Only the ratios of the exposures matter, so their unit is free.

    For a grey wedge, one picture and the wedge's certified densities suffice. Without exposure series and grey wedge,
    --edges estimates a power law to about 5 % from the shape of straight edges, if the camera does not sharpen.
    """
    from fingervision.cli._measuring_response import measure_response
    from fingervision.interface.argument_checks import python_words

    with python_words():
        measure_response(**options)


@command.command("check", epilog=CHECK_EXAMPLES)
@click.argument("calibration", type=FILE)
@_size_options
@json_option("Print the result as JSON.")
def check(calibration: Path, items: Sequence[str], u_size_mm: float, roi: str | None, as_json: bool) -> None:
    """Measure an object of known size with an existing calibration and say whether both agree (E_n number)."""
    from fingervision.interface.argument_checks import python_words

    with python_words():
        from fingervision.interface.calibration import Calibration
        from fingervision.interface.reference_pictures import Reference, known_sizes

        references = [Reference(which, path, size_mm) for path, size_mm, which in named_references(items, "bar")]
        scale = Calibration.load(calibration)
        pictures = known_sizes(references, u_size_mm)
        results = scale.check_sizes(pictures, region_from(roi))
        if as_json:
            content = [
                {
                    "image": picture.name,
                    "measured_mm": each.measured_mm,
                    "u_measured_mm": each.u_measured_mm,
                    "size_mm": each.certified_mm,
                    "deviation_mm": each.deviation_mm,
                    "e_n": each.e_n,
                    "agrees": each.agrees,
                }
                for picture, each in zip(pictures, results, strict=True)
            ]
            click.echo(json.dumps(content))
            return
        for picture, each in zip(pictures, results, strict=True):
            words = "agrees with" if each.agrees else "DISAGREES with"
            click.echo(
                f"{picture.name}: measured {each.measured_mm:.4f} mm, U = {2 * each.u_measured_mm:.4f} mm (k = 2); "
                f"{words} {each.certified_mm:g} mm: deviation {1e3 * each.deviation_mm:+.2f} um, E_n = {each.e_n:+.2f}"
            )


@command.command("repeat", epilog=REPEAT_EXAMPLES)
@click.argument("tables", nargs=-1, required=True, metavar="GAPS.csv...", type=FILE)
@option("--tolerance-mm", type=NUMBER, help="Full width of the tolerance, for %GRR.")
@option("--by-input", is_flag=True, help="Treat every input_mm of the drive as a separate part of the study.")
@json_option("Print the result as JSON.")
def repeat(tables: Sequence[Path], tolerance_mm: float | None, by_input: bool, as_json: bool) -> None:
    """Gauge repeatability and reproducibility over repeated recordings (AIAG, analysis of variance).

    The scatter of the frames within a recording gives the repeatability. The differences between recordings of the same
    object, set up anew each time, give the reproducibility.
    """
    from fingervision.interface.argument_checks import python_words

    with python_words():
        from calib.gauge_study import gauge_study, refuse_moving, verdict
        from fingervision.storage.gaps_csv import read_gap_readings

        if len({table.resolve() for table in tables}) < len(tables):
            raise UsageError("Each table may be named only once, but one is named twice: leave out the second.")
        recordings = [read_gap_readings(table, by_input) for table in tables]
        parts = [part for part in recordings[0] if all(len(each.get(part, ())) >= 2 for each in recordings)]
        if not parts:
            raise DataError(
                "At least one part (object of known size) must have two readings or more in every recording, but none "
                "has: record the same part in all recordings."
            )
        for table, each in zip(tables, recordings, strict=True):
            for part in parts:
                refuse_moving(each[part], str(table) if part is None else f"{table} at input {part:g} mm")
        # Every cell of the study holds the same number of readings: as many as the shortest recording has.
        trials = min(len(each[part]) for each in recordings for part in parts)
        study = gauge_study([[each[part][:trials] for part in parts] for each in recordings])
        percent = None if tolerance_mm is None else study.percent_of(tolerance_mm)
        if as_json:
            content = {
                "repeatability_mm": study.repeatability_mm,
                "reproducibility_mm": study.reproducibility_mm,
                "grr_mm": study.grr_mm,
                "part_mm": study.part_mm,
                "percent_of_tolerance": percent,
                "percent_of_total": study.percent_of_total,
                "recordings": study.recordings,
                "parts": study.parts,
                "trials": study.trials,
            }
            click.echo(json.dumps(content))
            return
        click.echo(f"{study.recordings} recordings, {study.parts} part(s), {study.trials} readings each")
        click.echo(
            f"repeatability    {1e3 * study.repeatability_mm:9.4f} um   (equipment variation, standard deviation)"
        )
        click.echo(f"reproducibility  {1e3 * study.reproducibility_mm:9.4f} um   (from recording to recording)")
        click.echo(f"gauge R&R        {1e3 * study.grr_mm:9.4f} um")
        if study.percent_of_total is not None:
            click.echo(f"%GRR of the total variation: {study.percent_of_total:.2f} %")
        if percent is not None:
            click.echo(f"%GRR of {tolerance_mm:g} mm: {percent:.2f} % (six standard deviations): {verdict(percent)}")
        else:
            click.echo("State --tolerance-mm to see which share of the tolerance the gauge takes up.")
