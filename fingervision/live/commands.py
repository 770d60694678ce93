"""What the page may ask for: each request checked, done, and answered with a sentence."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2

from calib.calibration import BareScale
from fingervision import __version__
from fingervision.domain.direction import Direction
from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.domain.region import Region
from fingervision.live.frame_measurement import Seen
from fingervision.live.picture_calibration import calibrated
from fingervision.live.session import Session
from fingervision.storage.calibration_json import write_calibration
from fingervision.storage.gaps_csv import GapsCsv
from fingervision.vision.overlay import in_eight_bits
from fingervision.vision.pipeline import steps

SAVED_GAPS = "live_gaps.csv"
GREATEST = 10**12
"""No number that the page may ask for is larger; comparing is safe where converting is not (nan is not below it)."""
TIPS = ("auto", *(direction.value for direction in Direction))


@dataclass(frozen=True, slots=True)
class Answer:
    """What became of a request.

    Parameters
    ----------
    words : str
        For the user; empty where the page shows it anyway.
    pictures : tuple of (str, bytes)
        Names and PNG pictures of the steps.
    """

    words: str = ""
    pictures: tuple[tuple[str, bytes], ...] = ()


Request = Mapping[str, Any]


def obey(session: Session, request: Request) -> Answer:
    """Do what the page asks.

    Raises
    ------
    FingervisionError
        It cannot be done, or is nothing that can be asked.
    """
    name = request.get("do")
    command = COMMANDS.get(name) if isinstance(name, str) else None
    if command is None:
        raise UsageError(f"The page may ask for {', '.join(sorted(COMMANDS))}, but asked for {shown(name)}.")
    return command(session, request)


def save_gaps(session: Session) -> Path:
    """Write the gaps of the last minutes as gaps.csv has them.

    Raises
    ------
    FingervisionError
        The file cannot be written.
    """
    path = session.out / SAVED_GAPS
    with GapsCsv(path) as table:
        table.add(list(session.history.rows()))
    return path


def _record(session: Session, request: Request) -> Answer:
    session.record()
    return Answer()


def _stop(session: Session, request: Request) -> Answer:
    session.stop_recording()
    return Answer()


def _snapshot(session: Session, request: Request) -> Answer:
    seen = _seen(session)
    path = session.out / f"snapshot_{datetime.now(UTC).strftime('%Y-%m-%dT%H-%M-%S-%fZ')}.png"
    pixels = seen.frame.pixels
    try:
        path.write_bytes(_png(pixels if pixels.ndim == 2 else pixels[:, :, ::-1]))
    except OSError as error:
        raise FingervisionError(f"{path} could not be written ({error.strerror}): make room.") from error
    return Answer(f"Snapshot of frame {seen.frame.index}: {path}")


def _region(session: Session, request: Request) -> Answer:
    session.choose(region=None if request.get("box") is None else _box(request))
    return Answer()


def _tips(session: Session, request: Request) -> Answer:
    tips = request.get("tips")
    if tips not in TIPS:
        raise UsageError(f"The tips must be one of {', '.join(TIPS)}, but are {shown(tips)}.")
    session.choose(direction=None if tips == "auto" else Direction(tips))
    return Answer()


def _height(session: Session, request: Request) -> Answer:
    session.choose(below_tip_mm=_number(request, "below_tip_mm"))
    return Answer()


def _zero(session: Session, request: Request) -> Answer:
    if request.get("off"):
        session.choose(zero_mm=0.0)
        return Answer()
    row = _seen(session).row
    if row is None or row.gap_mm is None:
        raise FingervisionError("Zero needs a gap, but this frame has none: bring the fingers into view.")
    session.choose(zero_mm=row.gap_mm)
    return Answer(f"Gaps are shown less {row.gap_mm:.4f} mm; files hold them whole.")


def _limits(session: Session, request: Request) -> Answer:
    least, greatest = (None if request.get(name) is None else _number(request, name) for name in ("least", "greatest"))
    session.choose(least_mm=least, greatest_mm=greatest)
    return Answer()


def _scale(session: Session, request: Request) -> Answer:
    px_per_mm = _number(request, "px_per_mm")
    if px_per_mm <= 0.0:
        raise UsageError(f"px_per_mm must be positive, but is {px_per_mm:g}.")
    session.choose(scale=BareScale(px_per_mm), scale_file=None)
    return Answer()


def _calibrate(session: Session, request: Request) -> Answer:
    kind = request.get("kind")
    if kind not in ("bar", "slot"):
        raise UsageError(f"The reference must be a bar or a slot, but is {shown(kind)}.")
    found = calibrated(
        _seen(session).frame, _box(request), str(kind), _number(request, "size_mm"), _number(request, "u_size_mm")
    )
    made_at = datetime.now(UTC).isoformat(timespec="seconds")
    camera = dict(session.description.camera)
    found = replace(found, camera=camera, made_at=made_at, software=f"fingervision {__version__}")
    # A name of its own: a calibration that lies there is somebody's.
    path = session.out / f"calibration_{made_at.replace(':', '-').removesuffix('+00-00')}Z.json"
    session.choose(scale=found, scale_file=path)
    write_calibration(found, path)
    u = found.covariance[0, 0] ** 0.5
    return Answer(f"Calibrated: {found.px_per_mm:.4f} px/mm, u {u:.4f} px/mm; written to {path}.")


def _steps(session: Session, request: Request) -> Answer:
    task, frame = session.choices.task, _seen(session).frame
    if task is None:
        raise FingervisionError("The steps need the scale, which is not known: give it first.")
    return Answer(
        pictures=tuple(
            (name, _png(in_eight_bits(picture) if picture.ndim == 2 else picture[:, :, ::-1]))
            for name, picture in steps(frame, task.settings)
        )
    )


COMMANDS: Mapping[str, Callable[[Session, Request], Answer]] = {
    "record": _record,
    "stop": _stop,
    "snapshot": _snapshot,
    "region": _region,
    "tips": _tips,
    "height": _height,
    "zero": _zero,
    "limits": _limits,
    "scale": _scale,
    "calibrate": _calibrate,
    "steps": _steps,
}


def _seen(session: Session) -> Seen:
    if session.seen is None:
        raise FingervisionError("There is no picture yet: wait for the source.")
    return session.seen


def _number(request: Request, name: str) -> float:
    value = request.get(name)
    if not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= GREATEST:
        return float(value)
    raise UsageError(f"{name} must be a number, but is {shown(value)}.")


def shown(value: Any) -> str:
    """What was asked, in as few characters as tell; a number may have more digits than can be written."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > GREATEST:
        return "too large"
    return repr(str(value)[:40])


def _box(request: Request) -> Region:
    box = request.get("box")
    if not (
        isinstance(box, list)
        and len(box) == 4
        and all(isinstance(side, int) and not isinstance(side, bool) and abs(side) <= GREATEST for side in box)
    ):
        raise UsageError("The region must be four whole numbers (column, row, width, height), but are not.")
    return Region(*box)


def _png(picture: Any) -> bytes:
    return cv2.imencode(".png", picture)[1].tobytes()
