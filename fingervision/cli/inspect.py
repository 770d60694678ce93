"""`fingervision inspect`: list what limits the measurement, the uncertainty that it causes, and what to change."""

from pathlib import Path

import click

from fingervision.cli._number import NUMBER
from fingervision.cli._where_to_measure import how_to_read_pictures, region_of, where_to_measure
from fingervision.domain.errors import ExitCode, UsageError

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
# Without a scale, the edges are measured at this distance (pixels) below the tips.
WITHOUT_SCALE_PX = 10.0


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

    from calib.calibration import BareScale
    from fingervision.domain.direction import Direction
    from fingervision.frames import simulated
    from fingervision.frames.source import Wish, open_source
    from fingervision.inspection import report
    from fingervision.inspection.catalogue import inspect
    from fingervision.inspection.frames_to_look_at import frames_to_look_at
    from fingervision.inspection.picture import draw_inspection
    from fingervision.inspection.sample import take_sample
    from fingervision.measuring.scale import Scale, check_one_scale, stated_scale
    from fingervision.measuring.task import Task, task_for_frames
    from fingervision.storage.calibration_json import read_calibration
    from fingervision.storage.response_csv import response_named

    if not 0.0 < seconds < float("inf"):
        raise UsageError(f"--seconds must be positive, but is {seconds:g}.")
    check_one_scale(calibration, px_per_mm, u_px_per_mm)
    stated = simulated.PX_PER_MM if px_per_mm is None and simulated.accepts(source) else px_per_mm
    scale: Scale | None = None
    if calibration is not None:
        scale = read_calibration(calibration)
    elif stated is not None:
        scale = stated_scale(stated, u_px_per_mm)
    task = Task(
        scale=scale or BareScale(WITHOUT_SCALE_PX / below_tip_mm if below_tip_mm > 0.0 else 1.0),
        scale_file=calibration,
        below_tip_mm=below_tip_mm,
        direction=None if tips == "auto" else Direction(tips),
        region=region_of(roi),
        response=response_named(response),
        bits=bits,
        fingers_are_dark={"auto": None, "dark": True, "light": False}[fingers],
    )
    opened = open_source(source, Wish(rate_hz=rate_hz))
    description = opened.description
    task = task_for_frames(task, description)
    scale = None if scale is None else task.scale
    settings, warning = task.settings_for(description.files)
    try:
        sample = take_sample(frames_to_look_at(opened, seconds), description, settings, scale)
    finally:
        if hasattr(opened, "close"):
            opened.close()
    findings = inspect(sample)
    if not no_picture:
        draw_inspection(picture, sample, findings)
    if as_json:
        content = {**report.as_json(sample, findings), "picture": None if no_picture else str(picture)}
        click.echo(json.dumps(content))
    else:
        click.echo(report.as_text(sample, findings))
        for words in (*description.notes, warning):
            if words:
                click.echo(words)
        if not no_picture:
            click.echo(f"Written: {picture}")
    raise SystemExit(int(ExitCode.DONE if sample.looks else ExitCode.COULD_NOT))
