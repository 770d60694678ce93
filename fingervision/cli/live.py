"""`fingervision live`: show the camera's picture with the measured points, the gap, and the gap over time."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fingervision.cli._command import BED, CAMERA, FILE, MEASURED, MODEL, MODEL_FILE, NUMBER, PAGE, make_command, option
from fingervision.cli._options import (
    drive_options,
    hide_option,
    json_option,
    kind_option,
    out_option,
    port_option,
    region_from,
    where_to_measure,
)
from fingervision.domain.errors import UsageError

if TYPE_CHECKING:
    from fingervision.live.choices import Choices

EXAMPLES = """
\b
Examples:
  fingervision live simulated                          see it work, without a camera
  fingervision live --list                             the cameras of this machine
  fingervision live 0 --calibration calibration.json
  fingervision live /dev/video2 --size 1280x720 --rate-hz 30 --exposure-ms 8 --gain 0 --focus 30
  fingervision live http://192.168.1.20/video.mjpg --px-per-mm 34 --tips down
  fingervision live rtsp://camera/stream --calibration calibration.json --out runs
  fingervision live opening.mp4 --px-per-mm 34         look through a recording: scrub, step, play, measure a range
  fingervision live runs/2026-05-04T10-11-12Z          look through a run, measured as it was
  fingervision live opening.mp4 --calibration calibration.json --drive drive.csv --model comsol.csv
  fingervision live faulty.mp4 --beside healthy.mp4 --px-per-mm 34     two recordings and the difference of their gaps
  fingervision live --bed simulated --hide backlash:play_mm=0.03 --allow-motion
  fingervision live 0 --px-per-mm 34 --gauges my.toml  edges, marks and patches of one's own, drawn in the picture
  fingervision live 0 --px-per-mm 34 --no-page         gap, status and rate in the terminal
  fingervision live 0 --px-per-mm 34 --no-page --json  one line of JSON a frame
  fingervision live 0 --px-per-mm 34 --no-page --out runs   also records, from the first frame

\b
By default, only this computer can open the browser page, at the address that is printed (it contains a secret token).
A recorded run is a folder in --out: video.mp4 (lossless, or the camera's own packets), gaps.csv,
events.jsonl, run.json. `fingervision measure RUN/video.mp4` gives the same values again.

\b
Settings requested from a camera are read back; a setting that the camera did not accept is reported. The camera is
asked to keep exposure, focus and white balance constant.
"""
LIVE_FOLDER = Path("live")


@make_command(EXAMPLES)
@click.argument("source", required=False)
@where_to_measure
@option(
    "--gauges",
    type=FILE,
    group=MEASURED,
    help="File of user-defined gauges, which the browser page shows, measures and edits; it need not exist.",
)
@option("--list", "list_cameras", is_flag=True, group=CAMERA, help="List the cameras of this computer.")
@option("--size", metavar="WxH", group=CAMERA, help="Picture size to request from the camera.")
@option("--rate-hz", type=NUMBER, group=CAMERA, help="Frames per second to request from the camera.")
@option(
    "--format",
    "pixel_format",
    metavar="FOUR",
    group=CAMERA,
    help="Pixel format to request, such as YUYV (raw) or MJPG.  [default: raw]",
)
@option("--exposure-ms", type=NUMBER, group=CAMERA, help="Exposure time to request, in ms.")
@option("--gain", type=NUMBER, group=CAMERA, help="Gain (amplification) to request, in the camera's own units.")
@option("--focus", type=NUMBER, group=CAMERA, help="Focus to request, in the camera's own units.")
@option(
    "--white-balance-k",
    type=NUMBER,
    group=CAMERA,
    help="Colour temperature of the white balance to request, in kelvin.",
)
@option(
    "--as-camera",
    is_flag=True,
    group=CAMERA,
    help="Play a recording once in real time, as if it came from a camera.",
)
@option(
    "--model", "model_path", type=MODEL_FILE, group=MODEL, help="Compare the gap with this model while it is measured."
)
@kind_option
@option(
    "--beside",
    "second",
    metavar="RECORDING",
    group=MODEL,
    help="Second recording or run folder, shown in step with the first, with the difference of the gaps.",
)
@drive_options(
    "Log of the stage (drive.csv) on the clock of this live view or recording.",
    "Clock offset in seconds, added to the drive's times; determined for a recording if not given.",
)
@option(
    "--bed",
    "bed_name",
    metavar="simulated|CONFIG.toml",
    group=BED,
    help="Test bed whose camera is the source: the word simulated, or its configuration file.",
)
@hide_option
@option(
    "--allow-motion",
    is_flag=True,
    group=BED,
    help="Allow the browser page to move the test bed's stage; otherwise it can only show and stop it.",
)
@option("--no-page", is_flag=True, group=PAGE, help="Open no browser page; print gap, status and rate in the terminal.")
@option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    group=PAGE,
    help="Network address at which the browser page is served.",
)
@port_option
@option(
    "--password-file",
    type=FILE,
    group=PAGE,
    help="Text file with the password of the browser page; required if other computers can reach it.",
)
@option("--tls-cert", type=FILE, group=PAGE, help="Certificate (PEM) with which the browser page is served over TLS.")
@option("--tls-key", type=FILE, group=PAGE, help="Private key of the certificate (PEM).")
@out_option(words="Folder for runs and snapshots.  [default: live]")
@json_option("Print one line of JSON per frame, with the columns of gaps.csv.")
def command(
    source: str | None,
    list_cameras: bool,
    out: Path | None,
    as_camera: bool,
    no_page: bool,
    as_json: bool,
    host: str,
    port: int,
    password_file: Path | None,
    tls_cert: Path | None,
    tls_key: Path | None,
    size: str | None,
    rate_hz: float | None,
    pixel_format: str | None,
    exposure_ms: float | None,
    gain: float | None,
    focus: float | None,
    white_balance_k: float | None,
    model_path: Path | None,
    kind: str,
    second: str | None,
    drive: Path | None,
    drive_offset_s: float | None,
    gauges: Path | None,
    bed_name: str | None,
    hide: tuple[str, ...],
    allow_motion: bool,
    calibration: Path | None,
    px_per_mm: float | None,
    u_px_per_mm: float | None,
    below_tip_mm: float,
    tips: str,
    roi: str | None,
) -> None:
    """Show SOURCE: a camera number, a /dev path, a stream, a recording, a run folder, or the word simulated.

    Every frame is measured. The browser page shows the picture with the measured points, the gap with its uncertainty,
    and the gap over time; it can record, calibrate and save. In a recording you can scrub, step and play; it is
    measured as by `fingervision measure`.
    """
    if list_cameras:
        _list()
        return
    if bed_name is not None and source not in (None, "simulated", bed_name):
        raise UsageError(
            f"With --bed the test bed's own camera is the source, but {source} is named too: leave it out."
        )
    if bed_name is None and (hide or allow_motion):
        raise UsageError("--hide and --allow-motion are for a test bed, but none is named: name it with --bed.")
    if bed_name is not None and (no_page or drive is not None):
        raise UsageError(
            "--bed cannot be combined with --no-page or --drive: the test bed is operated from the browser "
            "page, and its stage supplies the input. Leave both options out."
        )
    if gauges is not None and no_page:
        raise UsageError(
            "--gauges are shown on the browser page: leave out --no-page, or use `fingervision measure --gauges`."
        )
    if second is not None and model_path is not None:
        raise UsageError("--beside and --model both fill the panel of the difference: leave one of them out.")
    if drive_offset_s is not None and drive is None:
        raise UsageError("--drive-offset-s needs a --drive.")
    if source is None and bed_name is None:
        raise UsageError("The source must be given, but is not: name a camera, stream or file, or use `simulated`.")
    from fingervision.frames.source import CameraWish, Wish
    from fingervision.frames.source_kinds import kind_of
    from fingervision.live.access import access
    from fingervision.live.beside import Beside
    from fingervision.live.opening import opened
    from fingervision.live.playback.recorded import is_recording, recorded
    from fingervision.live.running import Showing, look_through, run

    beside = Beside(model_path, kind, drive, drive_offset_s or 0.0, allow_motion, gauges)
    choices = choices_of(source, calibration, (px_per_mm, u_px_per_mm), below_tip_mm, tips, roi)
    if no_page and choices.scale is None:
        raise UsageError(
            "Without the browser page the scale must be given, but is not: add --calibration FILE (made by "
            "`fingervision "
            "calibrate`) or --px-per-mm S."
        )
    way = access(host, port, password_file, tls_cert, tls_key)
    showing = Showing(page=not no_page, json_lines=as_json, way=way, record=no_page and out is not None)
    if bed_name is not None:
        from fingervision.live.bed.bench import opened_bed

        bed_capture, bed_choices = opened_bed(bed_name, hide, choices)
        run(bed_capture, bed_choices, out or LIVE_FOLDER, showing, beside)
        return
    assert source is not None  # noqa: S101 - asked before
    if not no_page and not as_camera and is_recording(source):
        if size is not None:
            raise UsageError(f"--size is for cameras, but {source} is a recording: leave it out.")
        seen = recorded(source, rate_hz, choices, _drive_options(drive, drive_offset_s))
        look_through(seen, out or LIVE_FOLDER, showing, beside, gauges, (second, rate_hz, choices) if second else None)
        return
    if second is not None:
        kind_of(source)  # what is no source at all is told as that
        raise UsageError("--beside is for a recording, but the source is live: record it, and open the recording.")
    camera = CameraWish(pixel_format, exposure_ms, gain, focus, white_balance_k)
    capture = opened(source, Wish(rate_hz, None if size is None else _size(size), camera))
    run(capture, choices, out or LIVE_FOLDER, showing, beside)


def choices_of(
    source: str | None,
    calibration: Path | None,
    stated: tuple[float | None, float | None],
    below_tip_mm: float,
    tips: str,
    roi: str | None,
) -> "Choices":
    """Read scale, measuring height, direction of the tips, and region of interest from the options.

    The argument `stated` contains the values of --px-per-mm and --u-px-per-mm.

    Raises
    ------
    DataError, InputFileError
        The calibration cannot be read.
    UsageError
        An option makes no sense.
    """
    from fingervision.domain.direction import Direction
    from fingervision.domain.frame import Region
    from fingervision.frames import simulated
    from fingervision.interface.measuring_task import scale_of
    from fingervision.live.choices import Choices
    from fingervision.measuring.scale import check_one_scale

    check_one_scale(calibration, *stated)
    px_per_mm, u_px_per_mm = stated
    if calibration is None and px_per_mm is None and source is not None and simulated.accepts(source):
        px_per_mm = simulated.PX_PER_MM
    box = region_from(roi)
    return Choices(
        scale=None if calibration is None and px_per_mm is None else scale_of(calibration, px_per_mm, u_px_per_mm)[0],
        scale_file=calibration,
        below_tip_mm=below_tip_mm,
        direction=None if tips == "auto" else Direction(tips),
        region=None if box is None else Region(*box),
    )


def _drive_options(drive: Path | None, offset_s: float | None) -> tuple[str, ...]:
    if drive is None:
        return ()
    return ("--drive", str(drive), *(() if offset_s is None else ("--drive-offset-s", repr(offset_s))))


def _list() -> None:
    from fingervision.frames.camera import found_cameras

    cameras = found_cameras()
    for name, words in cameras:
        click.echo(f"{name}  {words}")
    if not cameras:
        click.echo("No camera was found. The source `simulated` works without one.")


def _size(words: str) -> tuple[int, int]:
    try:
        width_px, height_px = (int(part) for part in words.lower().split("x"))
    except ValueError:
        raise UsageError(f"--size must be WxH in pixels, such as 640x480, but is '{words}'.") from None
    if min(width_px, height_px) < 1:
        raise UsageError(f"--size must be positive, but is {words}.")
    return width_px, height_px
