"""`fingervision gauge`: draw user-defined gauges on a recording, in the browser."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fingervision.cli._command import FILE, MEASURED, PAGE, make_command, option
from fingervision.cli._options import out_option, port_option, rate_option, where_to_measure
from fingervision.cli.live import LIVE_FOLDER, choices_of
from fingervision.domain.errors import UsageError

if TYPE_CHECKING:
    from fingervision.live.choices import Choices

EXAMPLES = """
\b
Examples, in the folder of `fingervision example measure`:
  fingervision gauge opening.mp4 --px-per-mm 34
  fingervision gauge opening.mp4 --px-per-mm 34 --gauges levers.toml
  fingervision gauge opening.mp4 --calibration calibration.json --no-page

\b
To add a gauge in the panel, choose its kind and drag over the first video frame (across an edge, along a line, over a
circle or a patch), or press Add and type its numbers. Arrow keys move the chosen gauge by 1 px (with Shift by 10 px).
The value of a gauge is shown at once, computed by the code of `measure`. Save writes the gauges file and keeps the
comments in it; then `fingervision measure opening.mp4 --px-per-mm 34 --gauges gauges.toml` measures every frame.
"""


@make_command(EXAMPLES)
@click.argument("recording")
@option(
    "--gauges",
    type=FILE,
    default="gauges.toml",
    show_default="gauges.toml in the current folder",
    group=MEASURED,
    help="Gauges file: read if it exists, and saved to.",
)
@where_to_measure
@rate_option
@port_option
@option(
    "--no-page",
    is_flag=True,
    former=("--no-browser",),
    group=PAGE,
    help="Print the address of the browser page, but do not open it.",
)
@out_option(words="Folder for the measurements that the browser page saves.  [default: live]")
def command(
    recording: str,
    gauges: Path,
    rate_hz: float | None,
    out: Path | None,
    port: int,
    no_page: bool,
    calibration: Path | None,
    px_per_mm: float | None,
    u_px_per_mm: float | None,
    below_tip_mm: float,
    tips: str,
    roi: str | None,
) -> None:
    """Draw gauges on RECORDING (a video, images, a run folder) in the browser page of `fingervision live`.

    Gauges are edges, pairs of edges, lines, circles, marks, patches and gaps. On the browser page you draw, drag, type
    and name the gauges, and save them to a file for `fingervision measure --gauges`. Each gauge is shown over time with
    its uncertainty. The picture need not show fingers: they are looked for only if a gauge is a gap, or with --tips or
    --roi. Gauges can be drawn before a scale is known; their values appear once the scale is entered on the page.
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
    choices = _with_fingers_asked(choices, gauges)
    showing = Showing(page=True, json_lines=False, way=Access(port=port), record=False, browser=not no_page)
    look_through(recorded(recording, rate_hz, choices, ()), out or LIVE_FOLDER, showing, Beside(), gauges)


def _with_fingers_asked(choices: "Choices", gauges: Path) -> "Choices":
    """Choices that ask for fingers only if the gauges of a file, which need not exist, or the other choices do."""
    from fingervision.gauges.gauge_file import read_gauges
    from fingervision.measuring.task import fingers_asked

    drawn = read_gauges(gauges) if gauges.exists() else ()
    is_described = choices.region is not None or choices.direction is not None
    return replace(choices, fingers=fingers_asked(drawn, is_described=is_described))
