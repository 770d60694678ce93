"""`fingervision gauge`: draw user-defined gauges on a recording, in the browser."""

from pathlib import Path

import click

from fingervision.cli._live_choices import choices_of
from fingervision.cli._where_to_measure import where_to_measure
from fingervision.cli.live import USUAL_OUT, USUAL_PORT
from fingervision.domain.errors import UsageError

EXAMPLES = """
\b
Examples, in the folder of `fingervision example measure`:
  fingervision gauge opening.mp4 --px-per-mm 34
  fingervision gauge opening.mp4 --px-per-mm 34 --gauges levers.toml
  fingervision gauge opening.mp4 --calibration calibration.json --no-browser

\b
A gauge is added in the panel: choose its kind, and drag over the picture's first frame (across an edge, along a line,
over a circle or a patch), or press Add and type its numbers. Arrow keys move the chosen one by 1 px (with Shift 10).
What is drawn is read at once, by the code of `measure`. Save writes the file, and keeps its comments; then
`fingervision measure opening.mp4 --px-per-mm 34 --gauges gauges.toml` measures it in every frame.
"""
USUAL_GAUGES = Path("gauges.toml")


@click.command(epilog=EXAMPLES)
@click.argument("recording")
@click.option(
    "--gauges",
    type=click.Path(path_type=Path),
    default=USUAL_GAUGES,
    show_default="gauges.toml in the current folder",
    help="File that is read, where it exists, and saved to.",
)
@click.option("--rate-hz", type=float, help="Frames in a second, of images without times.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for what the page measures.  [default: live]")
@click.option("--port", type=click.IntRange(0, 65535), default=USUAL_PORT, show_default=True, help="0: any free one.")
@click.option("--no-browser", is_flag=True, help="Print the page's address, and open nothing.")
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
    below_tip_mm: float,
    tips: str,
    roi: str | None,
) -> None:
    """Draw gauges on RECORDING (a video, images, a run's folder) in the page of `fingervision live`.

    Edges, pairs of edges, lines, circles, marks, patches and gaps are drawn, dragged, typed, named and saved to a file
    that `fingervision measure --gauges` takes. Without a scale they can be drawn, and are read once the page is given
    one.
    """
    from fingervision.live.access import Access
    from fingervision.live.beside import Beside
    from fingervision.live.playback.recorded import is_recording, recorded
    from fingervision.live.running import Showing, look_through

    if not is_recording(recording):
        raise UsageError(
            "Gauges are drawn on an existing recording (a video, images, a run's folder), but "
            f"{recording} is none: name another, or draw them on a camera's picture with "
            "`fingervision live CAMERA --gauges FILE`."
        )
    choices = choices_of(None, calibration, px_per_mm, below_tip_mm, tips, roi)
    showing = Showing(page=True, json_lines=False, way=Access(port=port), record=False, browser=not no_browser)
    look_through(recorded(recording, rate_hz, choices, ()), out or USUAL_OUT, showing, Beside(), gauges)
