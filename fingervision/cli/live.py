"""`fingervision live`: show the camera's picture with the measured points, the gap, and the gap over time."""

from pathlib import Path

import click

from fingervision.cli._live_choices import choices_of
from fingervision.cli._number import NUMBER
from fingervision.cli._where_to_measure import where_to_measure
from fingervision.cli._which_model import ModelPath
from fingervision.domain.errors import UsageError

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
USUAL_OUT, USUAL_PORT = Path("live"), 8025
port_of_page = click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=USUAL_PORT,
    show_default=True,
    help="Network port of the browser page; 0: any free port.",
)


@click.command(epilog=EXAMPLES)
@click.argument("source", required=False)
@click.option("--list", "list_cameras", is_flag=True, help="List the cameras of this computer.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for runs and snapshots.  [default: live]")
@click.option("--as-camera", is_flag=True, help="Play a recording once in real time, as if it came from a camera.")
@click.option("--no-page", is_flag=True, help="Open no browser page; print gap, status and rate in the terminal.")
@click.option("--json", "as_json", is_flag=True, help="Print one line of JSON per frame, with the columns of gaps.csv.")
@click.option(
    "--host", default="127.0.0.1", show_default=True, help="Network address at which the browser page is served."
)
@port_of_page
@click.option(
    "--password-file",
    type=click.Path(path_type=Path),
    help="Text file with the password of the browser page; required if other computers can reach it.",
)
@click.option(
    "--tls-cert",
    type=click.Path(path_type=Path),
    help="Certificate (PEM) with which the browser page is served over TLS.",
)
@click.option("--tls-key", type=click.Path(path_type=Path), help="Private key of the certificate (PEM).")
@click.option("--size", metavar="WxH", help="Picture size to request from the camera.")
@click.option("--rate-hz", type=NUMBER, help="Frames per second to request from the camera.")
@click.option(
    "--format",
    "pixel_format",
    metavar="FOUR",
    help="Pixel format to request, such as YUYV (raw) or MJPG.  [default: raw]",
)
@click.option("--exposure-ms", type=NUMBER, help="Exposure time to request, in ms.")
@click.option("--gain", type=NUMBER, help="Gain (amplification) to request, in the camera's own units.")
@click.option("--focus", type=NUMBER, help="Focus to request, in the camera's own units.")
@click.option("--white-balance-k", type=NUMBER, help="Colour temperature of the white balance to request, in kelvin.")
@click.option(
    "--model",
    "model_path",
    type=ModelPath(),
    help="Compare the gap with this model while it is measured.",
)
@click.option(
    "--kind",
    type=click.Choice(["stiffness_matrix", "lumped", "finite_element"]),
    default="lumped",
    show_default=True,
    help="Kind of model by which a gripper.toml is computed.",
)
@click.option(
    "--drive",
    type=click.Path(path_type=Path),
    help="Log of the stage (drive.csv) on the clock of this live view or recording.",
)
@click.option(
    "--drive-offset-s",
    type=NUMBER,
    help="Clock offset in seconds, added to the drive's times; determined for a recording if not given.",
)
@click.option(
    "--gauges",
    type=click.Path(path_type=Path),
    help="File of user-defined gauges, which the browser page shows, measures and edits; it need not exist.",
)
@click.option(
    "--bed",
    "bed_name",
    metavar="simulated|CONFIG.toml",
    help="Test bed whose camera is the source: the word simulated, or its configuration file.",
)
@click.option(
    "--hide",
    multiple=True,
    metavar="EFFECT[:PARAMETER=VALUE,...]",
    help="Hide an effect in the simulated test bed: the measurement does not know it.",
)
@click.option(
    "--allow-motion",
    is_flag=True,
    help="Allow the browser page to move the test bed's stage; otherwise it can only show and stop it.",
)
@where_to_measure
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
    if drive_offset_s is not None and drive is None:
        raise UsageError("--drive-offset-s needs a --drive.")
    if source is None and bed_name is None:
        raise UsageError("The source must be given, but is not: name a camera, stream or file, or use `simulated`.")
    from fingervision.frames.source import CameraWish, Wish
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
        from fingervision.live.bed.opening import opened_bed

        bed_capture, bed_choices = opened_bed(bed_name, hide, choices)
        run(bed_capture, bed_choices, out or USUAL_OUT, showing, beside)
        return
    assert source is not None  # noqa: S101 - asked before
    if not no_page and not as_camera and is_recording(source):
        if size is not None:
            raise UsageError(f"--size is for cameras, but {source} is a recording: leave it out.")
        seen = recorded(source, rate_hz, choices, _drive_options(drive, drive_offset_s))
        look_through(seen, out or USUAL_OUT, showing, beside, gauges)
        return
    camera = CameraWish(pixel_format, exposure_ms, gain, focus, white_balance_k)
    capture = opened(source, Wish(rate_hz, None if size is None else _size(size), camera))
    run(capture, choices, out or USUAL_OUT, showing, beside)


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
