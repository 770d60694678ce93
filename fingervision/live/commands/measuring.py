"""Requests about measurement and display: region, tip direction, height, scale, zero, tolerance, step pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any

import cv2

from calib.errors import CalibrationError
from calib.known_widths import KnownSize
from calib.limits import Limits
from calib.measured_scale import Calibration
from calib.scale_from_sizes import MeasuredSize, scale_from_sizes
from fingervision import __version__
from fingervision.domain.direction import Direction
from fingervision.domain.errors import FingervisionError, NoCalibrationError, OutputError, StateError, UsageError
from fingervision.domain.frame import Region
from fingervision.domain.gap import GapMeasurement
from fingervision.live.commands.asking import Answer, Request, box, check_scale, number, number_or_none, one_of, seen_of
from fingervision.live.view import View
from fingervision.measuring.picture_response import PictureResponse, read_sizes
from fingervision.measuring.scale import stated_scale
from fingervision.measuring.task import FINGERS
from fingervision.storage.calibration_json import write_calibration
from fingervision.storage.out_folder import make_out_folder
from fingervision.vision.grey import to_grey
from fingervision.vision.overlay import in_eight_bits
from fingervision.vision.pipeline import steps

# Calibration from reference objects in pictures of the view, whose regions and sizes the user states.

REFERENCES = "references"


@dataclass(frozen=True, slots=True, eq=False)
class SeenReference:
    """A bar or slot of known size, measured in one picture of the view.

    Parameters
    ----------
    frame : int
        Number of the frame.
    size : MeasuredSize
        Certified and measured size.
    shift_px : float
        Width by which a light gap appears wider than with another usual camera response.
    read_with : PictureResponse
        Camera response with which the picture was read.
    """

    frame: int
    size: MeasuredSize
    shift_px: float
    read_with: PictureResponse


def seen_reference(view: View, region: Region, kind: str, size_mm: float, u_size_mm: float) -> SeenReference:
    """Measure the reference object in a rectangle of the displayed picture, as `calibrate bar|slot` does.

    Raises
    ------
    NoCalibrationError
        The part of the picture shows no reference of that kind.
    """
    frame = seen_of(view).frame
    try:
        known = KnownSize(f"in frame {frame.index}", kind, size_mm, u_size_mm, to_grey(frame.pixels).copy())
        read_with = PictureResponse.of("auto", view.description.files)
        box = (region.x_px, region.y_px, region.width_px, region.height_px)
        _, (size,), shift_px = read_sizes((known,), box, read_with)
    except CalibrationError as error:
        raise NoCalibrationError(str(error)) from error
    return SeenReference(frame.index, size, shift_px, read_with)


def calibrated(references: Sequence[SeenReference], frame_size_px: tuple[int, int]) -> Calibration:
    """Calibrate on references; three sizes, or a bar and a slot, determine the edge bias too.

    Raises
    ------
    NoCalibrationError
        The sizes contradict each other.
    """
    read_with = references[0].read_with
    shift_px = sum(each.shift_px for each in references) / len(references)
    try:
        sizes = [each.size for each in references]
        found = scale_from_sizes(sizes, frame_size_px, Limits(), response_shift_px=shift_px).calibration
    except CalibrationError as error:
        raise NoCalibrationError(str(error)) from error
    return read_with.noted(found, shift_px)


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
    tips = one_of(request, "tips", TIPS, "The direction of the tips")
    view.choose(direction=None if tips == "auto" else Direction(tips))
    return Answer()


def _fingers(view: View, request: Request) -> Answer:
    view.choose(fingers=one_of(request, "fingers", tuple(FINGERS), "The brightness of the fingers"))
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
    kind = one_of(request, "kind", ("bar", "slot"), "The reference object")
    seen = seen_reference(view, box(request), kind, number(request, "size_mm"), number(request, "u_size_mm"))
    references = [*view.features.get(REFERENCES, ()), seen]
    found = calibrated(references, (view.description.width_px, view.description.height_px))
    if request.get("more"):
        view.features[REFERENCES] = references
        return Answer(
            f"The {kind} is {seen.size.width_px:.3f} px wide in frame {seen.frame}: mark another reference, also in "
            "another frame."
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
    view.features.pop(REFERENCES, None)
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


def _forget_references(view: View, request: Request) -> Answer:
    view.features.pop(REFERENCES, None)
    return Answer()


def section(view: View) -> dict[str, Any]:
    """Return the references that are kept for a calibration, for the browser page."""
    kept = [each.size for each in view.features.get(REFERENCES, ())]
    return {
        REFERENCES: [f"{each.reference.what}: {each.reference.size_mm:g} mm = {each.width_px:.2f} px" for each in kept]
    }


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
    "forget_references": _forget_references,
    "steps": _steps,
}
HARMLESS = frozenset({"steps"})


def _png(picture: Any) -> bytes:
    return cv2.imencode(".png", picture)[1].tobytes()
