"""`fingervision inspect`: list what limits the measurement, the uncertainty that it causes, and what to change."""

from pathlib import Path

import click

from fingervision.cli._number import NUMBER
from fingervision.cli._references import region_from
from fingervision.cli._where_to_measure import how_to_read_pictures, where_to_measure
from fingervision.domain.errors import ExitCode

EXAMPLES = """
\b
Examples:
  fingervision inspect opening.mp4 --px-per-mm 34
  fingervision inspect /dev/video0 --calibration calibration.json --seconds 3
  fingervision inspect frames/ --px-per-mm 34 --json
  fingervision inspect simulated

\b
Exit codes: 0 done, whatever was found; 1 no frame could be measured, and the report says why; 2 wrong usage.
"""


@click.command(epilog=EXAMPLES)
@click.argument("source")
@where_to_measure
@click.option("--seconds", type=NUMBER, default=5.0, show_default=True, help="Duration of the inspection in seconds.")
@click.option("--rate-hz", type=NUMBER, help="Images per second, if the images carry no times.")
@how_to_read_pictures
@click.option(
    "--picture",
    type=click.Path(path_type=Path),
    default="inspection.png",
    show_default=True,
    help="File to which the picture of the inspection is written.",
)
@click.option("--no-picture", is_flag=True, help="Write no picture.")
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON.")
def command(
    source: str,
    calibration: Path | None,
    px_per_mm: float | None,
    u_px_per_mm: float | None,
    below_tip_mm: float,
    tips: str,
    roi: str | None,
    seconds: float,
    rate_hz: float | None,
    response: str,
    bits: int | None,
    fingers: str,
    picture: Path,
    no_picture: bool,
    as_json: bool,
) -> None:
    """Watch SOURCE (camera or recording) for some seconds and list what limits the measurement, worst first.

    Each limit (focus, exposure, gamma, compression, motion, light, tilt, scale, vibration, surroundings, view) is
    listed with its numbers, its cost in µm of uncertainty, and what to change. Without a scale, the costs are given in
    pixels.
    """
    import json

    from fingervision.interface.inspection import inspect

    found = inspect(
        source,
        calibration=calibration,
        px_per_mm=px_per_mm,
        u_px_per_mm=u_px_per_mm,
        below_tip_mm=below_tip_mm,
        tips=tips,
        roi=region_from(roi),
        seconds=seconds,
        rate_hz=rate_hz,
        response=response,
        bits=bits,
        fingers=fingers,
    )
    if not no_picture:
        found.save_picture(picture)
    if as_json:
        click.echo(json.dumps({**found.as_json(), "picture": None if no_picture else str(picture)}))
    else:
        click.echo(found.report())
        if not no_picture:
            click.echo(f"Written: {picture}")
    raise SystemExit(int(ExitCode.DONE if found.sample.looks else ExitCode.COULD_NOT))
