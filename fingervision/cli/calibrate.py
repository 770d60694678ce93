"""`fingervision calibrate`: scale in pixels per millimetre from a reference object, with an uncertainty budget."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from fingervision.cli._bench_limits import limit_options
from fingervision.cli._calibrating import calibrate_on_board, calibrate_on_lines, calibrate_on_sizes, sentences
from fingervision.cli._number import NUMBER
from fingervision.cli._references import named_references, region_from
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

Command = Callable[..., Any]


GROUP_EXAMPLES = """
\b
Examples:
  fingervision calibrate bar ref5.png=5.000 slot:ref3.png=3.000 --u-size-mm 0.0005 --plane-mm 0.2
  fingervision calibrate check calibration.json object.png=8.000 --u-size-mm 0.001
"""


@click.group("calibrate", epilog=GROUP_EXAMPLES)
def command() -> None:
    """Calibrate pixels to millimetres from a reference of known size."""


def _output_options(command: Command) -> Command:
    for option in reversed(
        (
            click.option("-o", "--out", default="calibration.json", type=click.Path(path_type=Path), show_default=True),
            click.option("--certificate", default="", help="Name of the reference's certificate."),
            click.option("--date", default="", help="Date of the certificate."),
            click.option(
                "--response",
                default="auto",
                show_default=True,
                metavar="auto|linear|srgb|bt709|FILE",
                help="Camera response (light for each grey level); auto: the pictures' own tag, else linear.",
            ),
            click.option(
                "--camera",
                multiple=True,
                metavar="NAME=VALUE",
                help="A camera setting to record in the calibration; repeatable.",
            ),
            click.option("--no-picture", is_flag=True, help="Write no calibration picture."),
            click.option("--json", "as_json", is_flag=True, help="Print the result as JSON."),
        )
    ):
        command = option(command)
    return command


def _size_options(command: Command) -> Command:
    for option in reversed(
        (
            click.argument("items", nargs=-1, required=True, metavar="IMAGE=SIZE_MM..."),
            click.option(
                "--u-size-mm",
                type=NUMBER,
                default=0.001,
                show_default=True,
                help="Standard uncertainty of every size, mm.",
            ),
            click.option("--roi", metavar="X,Y,W,H", help="Use only this part of every picture."),
        )
    ):
        command = option(command)
    return command


@command.command("bar", epilog=BAR_EXAMPLES)
@_size_options
@limit_options
@_output_options
def bar(**options: Any) -> None:
    """Calibrate on bars: objects with two parallel straight edges at a known distance.

    Each picture shows one object, in any direction; the object may extend beyond the picture. Objects of three
    different sizes determine scale and edge bias. Fewer sizes determine only the scale; the edge bias is then not
    corrected, and its limit enters the budget. To add slots, prefix an item: slot:ref3.png=3.000.
    """
    calibrate_on_sizes("bar", **options)


@command.command("slot", epilog=SLOT_EXAMPLES)
@_size_options
@limit_options
@_output_options
def slot(**options: Any) -> None:
    """Calibrate on slots: openings between two parallel straight edges at a known distance.

    All other options are as for `bar`. To add bars, prefix an item: bar:ref5.png=5.000.
    """
    calibrate_on_sizes("slot", **options)


def _board_options(command: Command) -> Command:
    for option in reversed(
        (
            click.argument("images", nargs=-1, required=True, metavar="IMAGE...", type=click.Path(path_type=Path)),
            click.option("--square-mm", type=NUMBER, required=True, help="Side of a square, mm."),
            click.option(
                "--u-square-mm",
                type=NUMBER,
                default=None,
                help="Standard uncertainty of a square's side, mm.  [default: 0.1 % of it]",
            ),
        )
    ):
        command = option(command)
    return command


@command.command("chessboard", epilog=CHESSBOARD_EXAMPLES)
@_board_options
@click.option("--squares", required=True, metavar="9x6", help="Inner corners: 9x6 for a board of 10x7 squares.")
@limit_options
@_output_options
def chessboard(**options: Any) -> None:
    """Calibrate on a chessboard: lens and tilt from three pictures or more, only the plane from one picture.

    The first picture defines the plane in which distances are measured: put the board where the gripper moves. For the
    other pictures, tilt the board differently each time.
    """
    calibrate_on_board("chessboard", **options)


@command.command("charuco", epilog=CHARUCO_EXAMPLES)
@_board_options
@click.option("--squares", required=True, metavar="8x6", help="Squares along x and y.")
@click.option("--marker-mm", type=NUMBER, default=None, help="Side of a marker, mm.  [default: 0.75 of a square]")
@limit_options
@_output_options
def charuco(**options: Any) -> None:
    """Calibrate on a ChArUco board, which may extend beyond the picture; its marker dictionary is recognised.

    All other options are as for `chessboard`, but --squares counts squares and not inner corners.
    """
    calibrate_on_board("charuco", **options)


@command.command("scale", epilog=SCALE_EXAMPLES)
@click.argument("image", type=click.Path(path_type=Path))
@click.option("--pitch-mm", type=NUMBER, required=True, help="Certified distance of neighbouring lines, mm.")
@click.option(
    "--u-line-mm",
    type=NUMBER,
    default=0.0003,
    show_default=True,
    help="Standard uncertainty of every line's position, mm.",
)
@click.option(
    "--u-length-mm",
    type=NUMBER,
    default=0.001,
    show_default=True,
    help="Standard uncertainty of the length over all lines, mm.",
)
@click.option("--roi", metavar="X,Y,W,H", help="Use only this part of the picture.")
@limit_options
@_output_options
def scale(**options: Any) -> None:
    """Calibrate on a line scale (stage micrometer) over all its lines, in any direction.

    The scale comes from the middles of the lines: blooming and the camera's response move the two edges of a line in
    opposite directions and therefore do not move its middle. The edge bias of a gap is therefore not corrected; its
    limit enters the budget.
    """
    calibrate_on_lines(**options)


@command.command("response", epilog=RESPONSE_EXAMPLES)
@click.argument("items", nargs=-1, required=True, metavar="IMAGE[=EXPOSURE]...")
@click.option(
    "--edges",
    is_flag=True,
    help="Estimate the response from pictures of sharp, straight, plain edges that are not clipped.",
)
@click.option(
    "--densities",
    metavar="A:B:STEP|A,B,...",
    help="Measure the response on one picture of a grey wedge with these optical densities, lightest first.",
)
@click.option("--roi", metavar="X,Y,W,H", help="With --densities: region of the wedge's fields.")
@click.option("-o", "--out", default="response.csv", type=click.Path(path_type=Path), show_default=True)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def response(**options: Any) -> None:
    """Measure the camera's response (light for each grey level), best from a still scene at several exposures.

    For an exposure series, the scene needs flat parts of many shades (paper with grey fields). Change only the exposure
    time; leave aperture, light and focus unchanged. Only the ratios of the exposures matter, so their unit is free.

    For a grey wedge, one picture and the wedge's certified densities suffice. Without exposure series and grey wedge,
    --edges estimates a power law to about 5 % from the shape of straight edges, if the camera does not sharpen.
    """
    from fingervision.cli._measuring_response import measure_response

    with sentences():
        measure_response(**options)


@command.command("check", epilog=CHECK_EXAMPLES)
@click.argument("calibration", type=click.Path(path_type=Path))
@_size_options
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def check(calibration: Path, items: Sequence[str], u_size_mm: float, roi: str | None, as_json: bool) -> None:
    """Measure an object of known size with an existing calibration and say whether both agree (E_n number)."""
    with sentences():
        from fingervision.interface.calibration import Calibration
        from fingervision.interface.reference_pictures import Reference, known_sizes

        references = [Reference(which, path, size_mm) for which, path, size_mm in named_references(items, "bar")]
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
@click.argument("tables", nargs=-1, required=True, metavar="GAPS.csv...", type=click.Path(path_type=Path))
@click.option("--tolerance-mm", type=NUMBER, default=None, help="Full width of the tolerance, for %GRR.")
@click.option("--by-input", is_flag=True, help="Treat every input_mm of the drive as a separate part of the study.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def repeat(tables: Sequence[Path], tolerance_mm: float | None, by_input: bool, as_json: bool) -> None:
    """Gauge repeatability and reproducibility over repeated recordings (AIAG, analysis of variance).

    The scatter of the frames within a recording gives the repeatability. The differences between recordings of the same
    object, set up anew each time, give the reproducibility.
    """
    with sentences():
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
