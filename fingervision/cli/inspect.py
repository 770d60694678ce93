"""`fingervision inspect`: list what limits the measurement, the uncertainty that it causes, and what to change."""

from pathlib import Path
from typing import Any

import click

from fingervision.cli._command import MEASURED, NUMBER, OUTPUT, make_command, option
from fingervision.cli._options import (
    figure_option,
    fingers_option,
    how_to_read_pictures,
    json_option,
    rate_option,
    region_from,
    where_to_measure,
)
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


@make_command(EXAMPLES)
@click.argument("source")
@where_to_measure
@how_to_read_pictures
@fingers_option(default="auto", show_default=True)
@option(
    "--seconds",
    type=NUMBER,
    default=5.0,
    show_default=True,
    group=MEASURED,
    help="Duration of the inspection in seconds.",
)
@rate_option
@figure_option(
    "File to which the picture of the inspection is written.", "--picture", default="inspection.png", show_default=True
)
@option("--no-figure", is_flag=True, former=("--no-picture",), group=OUTPUT, help="Write no picture.")
@json_option("Print the findings as JSON.")
def command(source: str, roi: str | None, figure: Path, no_figure: bool, as_json: bool, **options: Any) -> None:
    """Watch SOURCE (camera or recording) for some seconds and list what limits the measurement, worst first.

    Each limit (focus, exposure, gamma, compression, motion, light, tilt, scale, vibration, surroundings, view) is
    listed with its numbers, its cost in µm of uncertainty, and what to change. Without a scale, the costs are given in
    pixels.
    """
    import json

    from fingervision.interface.inspection import inspect

    found = inspect(source, roi=region_from(roi), **options)
    if not no_figure:
        found.save_picture(figure)
    if as_json:
        click.echo(json.dumps({**found.as_json(), "picture": None if no_figure else str(figure)}))
    else:
        click.echo(found.report())
        if not no_figure:
            click.echo(f"Written: {figure}")
    raise SystemExit(int(ExitCode.DONE if found.sample.looks else ExitCode.COULD_NOT))
