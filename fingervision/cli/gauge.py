"""`fingervision gauge`: draw user-defined gauges on a recording, in the browser."""

from pathlib import Path

import click

from fingervision.cli._live_choices import choices_of
from fingervision.cli._number import NUMBER
from fingervision.cli._where_to_measure import where_to_measure
from fingervision.cli.live import USUAL_OUT, port_of_page
from fingervision.domain.errors import UsageError

EXAMPLES = """
\b
Examples, in the folder of `fingervision example measure`:
  fingervision gauge opening.mp4 --px-per-mm 34
  fingervision gauge opening.mp4 --px-per-mm 34 --gauges levers.toml
  fingervision gauge opening.mp4 --calibration calibration.json --no-browser

\b
To add a gauge in the panel, choose its kind and drag over the first video frame (across an edge, along a line, over a
circle or a patch), or press Add and type its numbers. Arrow keys move the chosen gauge by 1 px (with Shift by 10 px).
The value of a gauge is shown at once, computed by the code of `measure`. Save writes the gauges file and keeps the
comments in it; then `fingervision measure opening.mp4 --px-per-mm 34 --gauges gauges.toml` measures every frame.
"""
USUAL_GAUGES = Path("gauges.toml")


@click.command(epilog=EXAMPLES)
@click.argument("recording")
@click.option(
    "--gauges",
    type=click.Path(path_type=Path),
    default=USUAL_GAUGES,
    show_default="gauges.toml in the current folder",
    help="Gauges file: read if it exists, and saved to.",
)
@click.option("--rate-hz", type=NUMBER, help="Images per second, if the images carry no times.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder for the measurements that the browser page saves.  [default: live]",
)
@port_of_page
@click.option("--no-browser", is_flag=True, help="Print the address of the browser page, but open no browser.")
@where_to_measure
def command(
    recording: str,
    gauges: Path,
    rate_hz: float | None,
    out: Path | None,
    port: int,
    no_browser: bool,
    calibration: Path | None,
    px_per_mm: float | None,
    u_px_per_mm: float | None,
    below_tip_mm: float,
    tips: str,
    roi: str | None,
) -> None:
    """Draw gauges on RECORDING (a video, images, a run folder) in the browser page of `fingervision live`.

    Gauges are edges, pairs of edges, lines, circles, marks, patches and gaps. On the browser page you draw, drag, type
    and name the gauges, and save them to a file for `fingervision measure --gauges`. Gauges can be drawn before a scale
    is known; their values appear once the scale is entered on the browser page.
    """
    from fingervision.live.access import Access
    from fingervision.live.beside import Beside
    from fingervision.live.playback.recorded import is_recording, recorded
    from fingervision.live.running import Showing, look_through

    if not is_recording(recording):
        raise UsageError(
            "Gauges are drawn on an existing recording (a video, images, a run's folder), but "
            f"{recording} is not such a recording: name another, or draw them on a camera's picture with "
            "`fingervision live CAMERA --gauges FILE`."
        )
    choices = choices_of(None, calibration, (px_per_mm, u_px_per_mm), below_tip_mm, tips, roi)
    showing = Showing(page=True, json_lines=False, way=Access(port=port), record=False, browser=not no_browser)
    look_through(recorded(recording, rate_hz, choices, ()), out or USUAL_OUT, showing, Beside(), gauges)
