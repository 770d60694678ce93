"""`fingervision measure`: measure the finger gap over time in a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from fingervision.cli._command import FILE, MEASURED, OUTPUT, complain, make_command, option
from fingervision.cli._options import (
    columns_option,
    drive_options,
    fingers_option,
    how_to_read_pictures,
    json_option,
    out_option,
    rate_option,
    region_from,
    where_to_measure,
)
from fingervision.domain.errors import FingervisionError, UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fingervision.measuring.body_poses import FollowedBodies
    from fingervision.measuring.drawing_placement import GivenPoint
    from fingervision.measuring.measure import Measured
    from fingervision.measuring.task import Task
    from fingervision.models.mechanism import Mechanism

EXAMPLES = """
\b
Examples:
  fingervision measure opening.mp4 --calibration calibration.json
  fingervision measure opening.mp4 --px-per-mm 34 --overlay --out results/opening
  fingervision measure frames/ --rate-hz 25 --px-per-mm 34
  fingervision measure 'frames/*.png' --px-per-mm 34 --tips up --roi 100,80,400,300
  fingervision measure opening.mp4 --calibration calibration.json --drive drive.csv
  fingervision measure opening.mp4 --calibration calibration.json --drive drive.csv --drive-offset-s 0.12
  fingervision measure opening.mp4 --px-per-mm 34 --steps 10
  fingervision measure opening.mp4 --px-per-mm 34 --frames 20:60
  fingervision measure opening.mp4 --px-per-mm 34 --gauges gauges.toml --overlay

\b
Files written to --out:
  gaps.csv      one row per frame: gap with its uncertainty, points, tips, or why there is no value
  summary.json  counts, statistics, settings, scale, what the uncertainty includes and what not
  gap.png       the gap over time; with --gauges, where the frames show fingers
  drive_log.csv with --drive: the stage's log on the recording's clock, which diagnose reads
  bodies.csv    with --mechanism: pose and status of every body and hinge, frame by frame
  flexures.csv  with --mechanism: thickness and place of every flexure at rest
  gauges.csv    with --gauges: one row per value, time_s,gauge,quantity,value,u,unit,status
  gauges.png    with --gauges: each quantity over time, with its expanded uncertainty
  overlay.mp4   with --overlay: video with edges, tips, points and value drawn in
  steps/        with --steps: a picture of every processing step

\b
Exit codes: 0 done; 1 failed, or fewer than one frame in ten shows fingers; 2 wrong usage;
3 done, but the recording was damaged: everything that could be read is written.
"""


@make_command(EXAMPLES)
@click.argument("recording")
@where_to_measure
@how_to_read_pictures
@fingers_option(
    "none",
    words="; none measures no gap",
    show_default="auto",
)
@option(
    "--face",
    type=click.Choice(["front", "outline"]),
    default="front",
    show_default=True,
    group=MEASURED,
    help="Edge to measure on a thick part: that of the face towards the camera, or the outline with side walls.",
)
@option(
    "--frames",
    metavar="FIRST:LAST",
    group=MEASURED,
    help="Measure only these frames; counted from 0, both included.",
)
@option(
    "--gauges",
    type=FILE,
    group=MEASURED,
    help="Also measure user-defined gauges (gauges.toml): edges, lines, circles, marks, patches.",
)
@option(
    "--mechanism",
    type=FILE,
    group=MEASURED,
    help="gripper.toml or mechanism.toml: also measure the poses of its bodies (bodies.csv) and the distances of its "
    "pairs (gauges.csv); its fingers need no --roi.",
)
@option(
    "--at",
    "points",
    multiple=True,
    metavar="X,Y=XMM,YMM",
    group=MEASURED,
    help="With --mechanism: pixel X,Y of the first frame shows point XMM,YMM of the drawing; give three such points.",
)
@rate_option
@drive_options(
    "Log of the stage: drive.csv (time_s,input_mm[,run][,force_n]) or a table of any program.",
    "Clock offset in seconds, added to the drive's times; determined from the motion if not given.",
)
@columns_option
@out_option(words="Folder for the results; measured/<name of the recording> if not given.")
@option(
    "--overlay",
    is_flag=True,
    group=OUTPUT,
    help="Also write overlay.mp4, the video with the measurement drawn in.",
)
@option(
    "--steps",
    "steps_frame",
    type=int,
    metavar="FRAME",
    group=OUTPUT,
    help="Also write a picture of every processing step of this frame (counted from 0).",
)
@json_option("Print the summary as JSON.")
def command(
    recording: str,
    calibration: Path | None,
    px_per_mm: float | None,
    u_px_per_mm: float | None,
    roi: str | None,
    rate_hz: float | None,
    frames: str | None,
    mechanism: Path | None,
    points: tuple[str, ...],
    out: Path | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Measure the gap between two fingers in RECORDING: a video file, a folder of images, or a glob in quotes.

    The gap is the distance between the fingers' inner edges, 0.3 mm below their tips, in every frame, with its standard
    uncertainty. One of --calibration and --px-per-mm is required. With --gauges, the picture need not show fingers.
    """
    from fingervision.interface.measure import measure_into
    from fingervision.interface.measuring_task import measuring_task, scale_of

    if points and mechanism is None:
        raise UsageError(
            "--at states where the drawing of a mechanism lies in the picture, but no drawing is given: add "
            "--mechanism FILE, or leave --at out."
        )
    if mechanism is not None:
        options["fingers"] = options["fingers"] or "auto"
    task = measuring_task(
        scale=scale_of(calibration, px_per_mm, u_px_per_mm), roi=region_from(roi), frames=_frames(frames), **options
    )
    # Errors of the drawing or its points are reported before the recording is measured.
    drawing = None if mechanism is None else _drawing(mechanism, points)
    bodies, why_not = None, None
    if drawing is not None:
        source = click.get_current_context().get_parameter_source("below_tip_mm")
        is_stated = source != ParameterSource.DEFAULT
        try:
            bodies, task = _located(recording, rate_hz, task, drawing, is_height_stated=is_stated)
        except FingervisionError as error:
            # The gap is measured all the same, where the picture shows two fingers.
            why_not = error
    measured = measure_into(out, recording, task, rate_hz, progress=True)
    _report(measured, as_json)
    if bodies is not None:
        _write_bodies(bodies, measured.folder.path, task, as_json=as_json)
    if why_not is not None:
        raise why_not
    raise SystemExit(int(measured.exit_code))


def _frames(words: str | None) -> tuple[int, int] | None:
    if words is None:
        return None
    first, _, last = words.partition(":")
    if not (first.isascii() and first.isdigit() and last.isascii() and last.isdigit()):
        raise UsageError(f"--frames must be FIRST:LAST, two whole numbers such as 100:250, but is '{words}'.")
    return int(first), int(last)


def _drawing(path: Path, points: tuple[str, ...]) -> tuple["Mechanism", list["GivenPoint"]]:
    """Read a mechanism.toml, or a gripper.toml as a mechanism of its two halves, and the points that place it."""
    from fingervision.measuring.drawing_placement import parse_point
    from fingervision.models.gripper_mechanism import whole_mechanism
    from fingervision.storage.gripper_toml import read_gripper
    from fingervision.storage.mechanism_toml import is_mechanism, read_mechanism

    given = [parse_point(text) for text in points]
    if is_mechanism(path):
        return read_mechanism(path), given
    gripper = read_gripper(path)
    return whole_mechanism(gripper, gripper, path.stem), given


def _located(
    recording: str,
    rate_hz: float | None,
    task: "Task",
    drawing: tuple["Mechanism", list["GivenPoint"]],
    *,
    is_height_stated: bool,
) -> tuple["FollowedBodies", "Task"]:
    """Follow the bodies of the drawing, and state where its fingers and pairs are seen."""
    from fingervision.frames.frame_range import frame_range
    from fingervision.frames.source import Wish
    from fingervision.frames.source_kinds import open_source
    from fingervision.measuring.body_poses import BodyTracker, FollowedBodies
    from fingervision.measuring.drawn_fingers import located
    from fingervision.measuring.frame_loop import coded, prepared
    from fingervision.measuring.task import task_for_frames

    source = open_source(recording, Wish(rate_hz=rate_hz))
    complete = task_for_frames(task, source.description)
    how = prepared(source.description, complete)
    frames = coded(source, how.description.coding)
    if task.frames is not None:
        frames = frame_range(frames, *task.frames)
    tracker = BodyTracker(drawing[0], complete.scale, drawing[1], how.settings)
    bodies = FollowedBodies(tracker, list(tracker.poses(frames)))
    size_px = source.description.width_px, source.description.height_px
    return bodies, located(task, bodies, size_px, at_drawn_height=not is_height_stated)


def _write_bodies(bodies: "FollowedBodies", folder: Path, task: "Task", *, as_json: bool) -> None:
    """Write bodies.csv, and print in how many frames each body was found."""
    from fingervision.models.physical_gripper import GAP

    path, placed = bodies.write(folder), bodies.tracker.placed
    if as_json:
        return
    for name, counts in bodies.counts.items():
        others = ", ".join(f"{count} {status}" for status, count in counts.items() if status != "ok")
        said = f" ({others})" if others else ""
        click.echo(f"  {name}: seen in {counts['ok']} of {sum(counts.values())} frames{said}")
    for note in () if placed is None else placed.notes:
        click.echo(f"  note: {note}")
    if any(gauge.name == GAP for gauge in task.gauges):
        click.echo(
            f"  note: the gap is measured {task.below_tip_mm:.3g} mm below the tips; the distance at the points of the "
            "drawing is that of the pair gap, in gauges.csv."
        )
    click.echo(f"  {path}")


def _report(measured: "Measured", as_json: bool) -> None:
    """Print the results on standard output, and errors on standard error."""
    from fingervision.domain.status import Status
    from fingervision.storage.summary_json import summary_text

    summary, series, folder = measured.summary, measured.series, measured.folder
    if as_json:
        click.echo(summary_text(summary), nl=False)
    else:
        _print_result(measured)
    counts = ", ".join(f"{count} {status.value}" for status, count in series.counts.most_common())
    if measured.stopped:
        _complain(
            f"Stopped by the user after {series.frames} frames; what was measured until then is in {folder.path}."
        )
    elif not series.frames and (asked := summary["settings"]["frames"]) is not None and asked[0]:
        _complain(
            f"--frames must begin within the recording, but {summary['recording']['name']} ends before frame "
            f"{asked[0]}: give an earlier first frame."
        )
    elif not series.frames:
        _complain(f"{summary['recording']['name']} must have at least one picture, but has none: record it again.")
    elif summary["settings"]["fingers"] == "none" and not measured.has_gauge_numbers:
        _complain(f"No gauge has a value in any of the {series.frames} frames{_why_none(summary)}")
    elif not series.counts[Status.OK] and not measured.has_gauge_numbers:
        first = min(series.first_without.values(), key=lambda bad: bad.frame)
        _complain(
            f"None of the {series.frames} frames could be measured ({counts}). Frame {first.frame}: {first.words} To "
            f"see why, add --steps {first.frame}; the table of all frames is {folder.gaps}."
        )
    elif series.is_chance and not measured.has_gauge_numbers:
        first = min(series.first_without.values(), key=lambda bad: bad.frame)
        _complain(
            f"Fingers must be found in at least one frame in ten, but are found in {series.counts[Status.OK]} of "
            f"{series.frames} ({counts}), so that what was measured there is probably something else. Frame "
            f"{first.frame}: {first.words} State the region of the fingers with --roi; the table of all frames is "
            f"{folder.gaps}."
        )
    elif series.first_damaged is not None:
        bad = series.first_damaged
        _complain(
            f"The recording is damaged: {series.counts[Status.DAMAGED]} of {series.frames} frames could not be read, "
            f"the first is frame {bad.frame}. {bad.words} All other frames were measured."
        )


def _why_none(summary: "Mapping[str, Any]") -> str:
    """End of a sentence with the reason of the first gauge that has no value."""
    from fingervision.gauges.reading import MEANING

    for name, gauge in summary.get("gauges", {}).items():
        for status, why in gauge["why"].items():
            words = why["words"] or MEANING.get(status, "")
            return f": {name} is {status} in frame {why['first_frame']}: {words or 'see gaps.csv'}"
    return "; no gauges are given: add --gauges FILE."


def _print_result(measured: "Measured") -> None:
    from fingervision.measuring.words import result_sentences

    for sentence in result_sentences(measured.summary, measured.series):
        click.echo(sentence)
    folder = measured.folder
    tables, figures = (folder.gaps, folder.gauges, folder.drive_log), (folder.figure, folder.gauge_figure)
    files = [*tables, folder.summary, *figures, folder.overlay, folder.steps]
    click.echo("Written: " + ", ".join(str(file) for file in files if file.exists()))


def _complain(sentence: str) -> None:
    complain(sentence)
