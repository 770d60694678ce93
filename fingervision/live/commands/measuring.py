"""Requests about measurement and display: region, tip direction, height, scale, zero, tolerance, step pictures."""

from dataclasses import replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any

import cv2

from calib.errors import CalibrationError
from calib.known_widths import KnownSize, find_widths
from calib.limits import Limits
from calib.measured_scale import Calibration, Reference
from calib.scale_from_sizes import MeasuredSize, scale_from_sizes
from fingervision import __version__
from fingervision.domain.direction import Direction
from fingervision.domain.errors import FingervisionError, NoCalibrationError, OutputError, StateError, UsageError
from fingervision.domain.frame import Frame, Region
from fingervision.domain.gap import GapMeasurement
from fingervision.live.commands.asking import Answer, Request, box, check_scale, number, number_or_none, seen_of, shown
from fingervision.live.view import View
from fingervision.measuring.scale import stated_scale
from fingervision.storage.calibration_json import write_calibration
from fingervision.storage.out_folder import make_out_folder
from fingervision.vision.grey import to_grey
from fingervision.vision.overlay import in_eight_bits
from fingervision.vision.pipeline import steps

# Calibration from a reference object in the live picture, whose region and size the user states.


NAME = "the live picture"


def calibrated(frame: Frame, region: Region, kind: str, size_mm: float, u_size_mm: float) -> Calibration:
    """Calibrate on one bar or slot in a rectangle of the picture.

    Parameters
    ----------
    frame : Frame
        The picture.
    region : Region
        Rectangle that contains the reference object.
    kind : str
        "bar" or "slot".
    size_mm, u_size_mm : float
        Size of the reference object, and the standard uncertainty of this size.

    Returns
    -------
    Calibration
        Calibration from a single size, so that the uncorrected edge bias is a contribution to the budget.

    Raises
    ------
    NoCalibrationError
        The part of the picture shows no reference of that kind.
    """
    try:
        picture = KnownSize(NAME, kind, size_mm, u_size_mm, to_grey(frame.pixels).copy())
        box = (region.x_px, region.y_px, region.width_px, region.height_px)
        (edges,) = find_widths((picture,), box)
        reference = Reference(f"{kind} in the live picture", size_mm, u_size_mm, "", "")
        size = MeasuredSize(reference, edges.width_px, edges.u_width_px, edges.points_px, edges.light)
        return scale_from_sizes((size,), (frame.width_px, frame.height_px), Limits()).calibration
    except CalibrationError as error:
        raise NoCalibrationError(str(error)) from error


POLARITIES = ("auto", "dark", "light")
LEAST_REGION_PX = 8
"""Smallest side of a region that is set on the page, as in `page/dragging.js`: no finger is seen in less."""
TIPS = ("auto", *(direction.value for direction in Direction))


def _region(view: View, request: Request) -> Answer:
    region = None if request.get("box") is None else box(request)
    if region is not None and 0 < min(region.width_px, region.height_px) < LEAST_REGION_PX:
        raise UsageError(
            f"The region must be at least {LEAST_REGION_PX} pixels wide and high, but is "
            f"{region.width_px}x{region.height_px} pixels."
        )
    view.choose(region=region)
    return Answer()


def _tips(view: View, request: Request) -> Answer:
    tips = request.get("tips")
    if tips not in TIPS:
        raise UsageError(f"The direction of the tips must be one of {', '.join(TIPS)}, but is {shown(tips)}.")
    view.choose(direction=None if tips == "auto" else Direction(tips))
    return Answer()


def _fingers(view: View, request: Request) -> Answer:
    fingers = request.get("fingers")
    if fingers not in POLARITIES:
        raise UsageError(
            f"The brightness of the fingers must be one of {', '.join(POLARITIES)}, but is {shown(fingers)}."
        )
    view.choose(fingers_are_dark={"auto": None, "dark": True, "light": False}[str(fingers)])
    return Answer()


def _height_at(view: View, request: Request) -> Answer:
    """Set the measuring height to that of a point which the user clicked in the picture."""
    outcome, scale = seen_of(view).outcome, view.choices.scale
    if scale is None or not isinstance(outcome, GapMeasurement):
        raise StateError(
            "The measuring height is a distance from the tips, which this frame does not show: bring both tips into "
            "the picture."
        )
    at_px = number(request, "y" if outcome.direction.is_vertical else "x")
    tips_px = 0.5 * (outcome.left.tip_px + outcome.right.tip_px)
    roots_are_after = outcome.direction in (Direction.UP, Direction.LEFT)
    below_px = at_px - tips_px if roots_are_after else tips_px - at_px
    if below_px <= 0.0:
        raise UsageError(f"The measuring height must lie on the fingers, but is {-below_px:.0f} px beyond their tips.")
    view.choose(below_tip_mm=round(below_px / scale.px_per_mm, 3))
    return Answer(f"The measuring height is now {view.choices.below_tip_mm:g} mm below the tips.")


def _height(view: View, request: Request) -> Answer:
    view.choose(below_tip_mm=number(request, "below_tip_mm"))
    return Answer()


def _zero(view: View, request: Request) -> Answer:
    if request.get("off"):
        view.choose(zero_mm=0.0)
        return Answer()
    row = seen_of(view).row
    if row is None or row.gap_mm is None:
        raise StateError("Setting the zero needs a measured gap, but this frame has none: bring the fingers into view.")
    view.choose(zero_mm=row.gap_mm)
    return Answer(f"Displayed gaps are reduced by {row.gap_mm:.4f} mm; files contain the full gaps.")


def _limits(view: View, request: Request) -> Answer:
    view.choose(least_mm=number_or_none(request, "least"), greatest_mm=number_or_none(request, "greatest"))
    return Answer()


def _scale(view: View, request: Request) -> Answer:
    px_per_mm, u_px_per_mm = number(request, "px_per_mm"), number_or_none(request, "u_px_per_mm")
    if px_per_mm <= 0.0:
        raise UsageError(f"The scale must be positive, but is {px_per_mm:g} px/mm.")
    check_scale(view, px_per_mm, request)
    view.choose(scale=stated_scale(px_per_mm, u_px_per_mm), scale_file=None)
    return Answer()


def _calibrate(view: View, request: Request) -> Answer:
    kind = request.get("kind")
    if kind not in ("bar", "slot"):
        raise UsageError(f"The reference object must be a bar or a slot, but is {shown(kind)}.")
    found = calibrated(
        seen_of(view).frame, box(request), str(kind), number(request, "size_mm"), number(request, "u_size_mm")
    )
    check_scale(view, found.px_per_mm, request)
    made_at = datetime.now(UTC).isoformat(timespec="seconds")
    camera = dict(view.description.camera)
    found = replace(found, camera=camera, made_at=made_at, software=f"fingervision {__version__}")
    make_out_folder(view.out)
    path = _free_name(view.out, f"calibration_{made_at.replace(':', '-').removesuffix('+00-00')}Z")
    write_calibration(found, path)
    try:
        view.choose(scale=found, scale_file=path)
    except FingervisionError:
        path.unlink(missing_ok=True)
        raise
    u = found.covariance[0, 0] ** 0.5
    return Answer(f"Calibrated: {found.px_per_mm:.4f} px/mm, u {u:.4f} px/mm; written to {path}.")


def _free_name(folder: Path, stem: str) -> Path:
    """Choose an unused file name, so that no existing calibration is overwritten."""
    for again in count(1):
        path = folder / (f"{stem}.json" if again == 1 else f"{stem}-{again}.json")
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            continue
        except OSError as error:
            raise OutputError(
                f"The folder {folder} cannot be written ({error.strerror}): record to another folder."
            ) from error
        return path
    raise AssertionError("an unused name is always found")


def _steps(view: View, request: Request) -> Answer:
    task, frame = view.choices.task, seen_of(view).frame
    if task is None:
        raise StateError(
            "Drawing the steps of the measurement needs the scale, which is not known: give the scale first."
        )
    return Answer(
        pictures=tuple(
            (name, _png(in_eight_bits(picture) if picture.ndim == 2 else picture[:, :, ::-1]))
            for name, picture in steps(frame, task.settings)
        )
    )


COMMANDS = {
    "region": _region,
    "tips": _tips,
    "fingers": _fingers,
    "height": _height,
    "height_at": _height_at,
    "zero": _zero,
    "limits": _limits,
    "scale": _scale,
    "calibrate": _calibrate,
    "steps": _steps,
}
HARMLESS = frozenset({"steps"})


def _png(picture: Any) -> bytes:
    return cv2.imencode(".png", picture)[1].tobytes()
