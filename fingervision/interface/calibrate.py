"""`fingervision.calibrate`: pixels to millimetres from a reference, with the uncertainty budget."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

from calib.board import Board, find_corners
from calib.calibration_picture import picture_of_corners, picture_of_edges, picture_of_lines
from calib.limits import Limits
from calib.line_scale import find_lines
from calib.measured_scale import Calibration as MeasuredScale
from calib.measured_scale import Reference as Certified
from calib.scale_from_board import scale_from_board
from calib.scale_from_lines import scale_from_lines
from calib.scale_from_sizes import scale_from_sizes
from fingervision import __version__
from fingervision.domain.errors import ArgumentError, ArgumentTypeError
from fingervision.frames.array_levels import what_it_is
from fingervision.interface.argument_checks import number, one_of, region_of, speaks_python
from fingervision.interface.calibration import Calibration, board_lines, line_details, line_lines, sizes_lines
from fingervision.interface.reference_pictures import (
    Reference,
    files_of,
    known_sizes,
    read_pictures,
    references_of,
)
from fingervision.measuring.picture_response import PictureResponse, read_sizes

# Limits of the set-up that enter the uncertainty (plane, tilt, temperature), with defaults for those not stated.


# Residual distortion of a calibrated lens, relative to the radius at the corner (as the rows and columns of a board
# show).
LENS_LEFT = 0.0002


def limits_from(stated: Mapping[str, float | None], *, lens_calibrated: bool) -> tuple[Limits, frozenset[str]]:
    """Return the limits of the set-up, and the names of those that the user stated.

    Parameters
    ----------
    stated : mapping of str to float or None
        Limits by their names in `calib.Limits`; None for a limit that is not stated.
    lens_calibrated : bool
        Whether the distortion of the lens is corrected, so that the residual distortion is smaller.
    """
    given = {name: value for name, value in stated.items() if value is not None}
    defaults = {"lens_relative": LENS_LEFT} if lens_calibrated else {}
    return Limits(**(defaults | given)), frozenset(given)


Region = tuple[int, int, int, int]
Stated = Mapping[str, float | None]


@dataclass(frozen=True, slots=True)
class Noted:
    """Notes that are stored with a calibration: certificate, date, camera and response.

    Parameters
    ----------
    certificate, date : str
        Name and date of the certificate of the reference.
    response : str
        Camera response: the light that each grey level stands for.
    camera : mapping of str to str
        Settings of the camera.
    """

    certificate: str = ""
    date: str = ""
    response: str = "auto"
    camera: Mapping[str, str] = field(default_factory=dict)


def on_sizes(
    references: Sequence[Reference],
    u_size_mm: float,
    region: Region | None,
    limits: Stated,
    noted: Noted,
) -> Calibration:
    """Calibrate on bars and slots of known size."""
    stored = known_sizes(references, u_size_mm)
    read_with = PictureResponse.of(noted.response, files_of([each.source for each in references]))
    bench, stated_limits = limits_from(limits, lens_calibrated=False)
    edges, sizes, shift_px = read_sizes(stored, region, read_with, noted.certificate, noted.date)
    height, width = stored[0].grey.shape
    fit = scale_from_sizes(sizes, (width, height), bench, stated_limits, 0.0 if read_with.is_known else shift_px)
    details = {
        "bias_known": fit.bias_known,
        "chi_square": fit.chi_square,
        "freedom": fit.freedom,
        "references": [
            {
                "what": size.reference.what,
                "size_mm": size.reference.size_mm,
                "width_px": edge.width_px,
                "u_width_px": edge.u_width_px,
                "profiles": edge.profiles,
                "first": edge.first,
                "last": edge.last,
                "count": edge.count,
                "taper_px": edge.taper,
                "u_taper_px": edge.u_taper,
                "residual_mm": float(residual),
            }
            for size, edge, residual in zip(sizes, edges, fit.residual_mm, strict=True)
        ],
    }
    drawn = {
        picture.name: picture_of_edges(
            picture.grey, edge, f"{picture.name}: {picture.size_mm:g} mm = {edge.width_px:.3f} px"
        )
        for picture, edge in zip(stored, edges, strict=True)
    }
    scale = _complete(read_with.noted(fit.calibration, shift_px), noted.camera)
    return Calibration(scale, None, tuple(sizes_lines(fit, edges)), drawn, details)


def on_board(
    sources: Sequence[Any],
    board: Board,
    limits: Stated,
    noted: Noted,
) -> Calibration:
    """Calibrate on a chessboard or ChArUco board."""
    bench, stated = limits_from(limits, lens_calibrated=len(sources) > 1)
    stored = read_pictures(sources)
    read_with = PictureResponse.of(noted.response, files_of(sources))
    pictures = [read_with.light(grey) for _, grey in stored]
    corners = [find_corners(grey, board, name) for grey, (name, _) in zip(pictures, stored, strict=True)]
    height, width = pictures[0].shape
    fit = scale_from_board(corners, board, (width, height), bench, stated)
    certified = tuple(
        replace(each, certificate=noted.certificate, date=noted.date) for each in fit.calibration.references
    )
    # A corner of a board lies between equal edges on all sides, so that the response does not move it.
    scale = _complete(read_with.noted(replace(fit.calibration, references=certified), 0.0), noted.camera)
    residuals = [fit.plane.residual_px] if fit.lens is None else fit.lens.residual_px
    # A single picture gives only the plane and its residuals.
    drawn = {
        found.name: picture_of_corners(grey, found.points_px, residual, f"{found.name}: {len(found.points_px)} corners")
        for (_, grey), found, residual in zip(stored, corners, residuals, strict=True)
    }
    details = {
        "rms_px": None if fit.lens is None else fit.lens.rms_px,
        "straightness_px": fit.straightness_px,
        "tilt_deg": fit.plane.tilt_deg,
    }
    return Calibration(scale, None, tuple(board_lines(fit)), drawn, details)


def on_lines(
    source: Any,
    scale_lines: tuple[float, float, float],
    region: Region | None,
    limits: Stated,
    noted: Noted,
) -> Calibration:
    """Calibrate on a line scale of known pitch; the uncertainties of a line's position and of the length are given."""
    pitch_mm, u_line_mm, u_length_mm = scale_lines
    ((name, stored),) = read_pictures([source])
    read_with = PictureResponse.of(noted.response, files_of([source]))
    bench, stated = limits_from(limits, lens_calibrated=False)
    lines = find_lines(read_with.light(stored), region)
    height, width = stored.shape
    reference = Certified(f"line scale {name}", pitch_mm, u_length_mm, noted.certificate, noted.date)
    fit = scale_from_lines(lines, pitch_mm, u_line_mm, u_length_mm, (width, height), bench, reference, stated)
    # The response moves the two edges of a line in opposite directions: its middle, and therefore the scale, does not
    # change.
    scale = _complete(read_with.noted(fit.calibration, 0.0), noted.camera)
    words = f"{name}: {len(lines.at_px)} lines, pitch {pitch_mm:g} mm"
    drawn = {name: picture_of_lines(stored, lines, fit.used, fit.residual_um, words)}
    return Calibration(scale, None, tuple(line_lines(fit, lines)), drawn, line_details(fit, lines))


def _complete(scale: MeasuredScale, camera: Mapping[str, str]) -> MeasuredScale:
    """Add the camera's settings, the date and the software version to a calibration."""
    made_at = datetime.now(UTC).isoformat(timespec="seconds")
    return replace(scale, camera=dict(camera), made_at=made_at, software=f"fingervision {__version__}")


KINDS = ("bar", "slot", "chessboard", "charuco", "scale")
MARKER_SHARE = 0.75
"""Ratio of the sides of a ChArUco marker and a square, as usually printed, if the marker's side is not stated."""
U_SQUARE = 0.001
"""Relative standard uncertainty of the side of a square, if it is not stated."""


@speaks_python
def calibrate(
    kind: str,
    pictures: Any,
    *,
    u_size_mm: float = 0.001,
    squares: Sequence[int] | None = None,
    square_mm: float | None = None,
    u_square_mm: float | None = None,
    marker_mm: float | None = None,
    pitch_mm: float | None = None,
    u_line_mm: float = 0.0003,
    u_length_mm: float = 0.001,
    roi: Sequence[int] | None = None,
    response: str = "auto",
    certificate: str = "",
    date: str = "",
    camera: Mapping[str, str] | None = None,
    plane_mm: float | None = None,
    camera_distance_mm: float | None = None,
    tilt_deg: float | None = None,
    lens_relative: float | None = None,
    edge_bias_px: float | None = None,
    estimator_px: float | None = None,
    temperature_k: float | None = None,
    expansion_per_k: float | None = None,
) -> Calibration:
    """Calibrate pixels to millimetres from pictures of a reference of known size; write nothing.

    Parameters
    ----------
    kind : str
        Kind of reference in the pictures: bar or slot (objects of known size, one object in each picture; three sizes
        give scale and edge bias), chessboard or charuco (three pictures or more also give the lens), scale (a line
        scale in one picture).
    pictures : mapping, sequence, path or ndarray
        For bars and slots: a mapping of file names to sizes in mm, or a sequence of (file name or array, size); the
        prefix `slot:` or `bar:` of a name states the kind of this object. For boards: a sequence of file names or
        arrays; in the first picture, the board lies in the plane of the gripper. For a line scale: one file name or
        array.
    u_size_mm : float
        Standard uncertainty of every size.
    squares : (int, int) or None
        Number of inner corners of a chessboard, or of squares of a ChArUco board, along x and y.
    square_mm, u_square_mm, marker_mm : float or None
        Side of a square, its standard uncertainty (by default a thousandth of the side), and side of a marker (by
        default 0.75 of the side of a square).
    pitch_mm, u_line_mm, u_length_mm : float or None
        For a line scale: distance of neighbouring lines, standard uncertainty of the position of every line, and
        standard uncertainty of the length over all lines.
    roi : (int, int, int, int) or None
        Use only this part of every picture: first column, first row, width, height; not for boards.
    response : str
        Light that each grey level stands for: auto, linear, srgb, bt709 or a file.
    certificate, date : str
        Name and date of the certificate of the reference.
    camera : mapping of str to str, or None
        Settings of the camera, to be compared with a recording's.
    plane_mm, camera_distance_mm, tilt_deg, lens_relative, edge_bias_px, estimator_px, temperature_k, expansion_per_k
        Limits of the set-up, for the budget; None takes the default of `calib.Limits`.

    Returns
    -------
    Calibration
        Scale, edge bias and budget, with the findings in each picture.

    Raises
    ------
    ArgumentError
        An argument has an impossible value, or is missing for this kind of reference.
    DataError, InputFileError, UsageError
        A picture cannot be read, or does not show the reference.

    Examples
    --------
    >>> import fingervision as fv
    >>> folder = "sample_frames/reference/"
    >>> sizes = {folder + "bar_05mm.png": 5.0, folder + "bar_11mm.png": 11.0, "slot:" + folder + "slot_03mm.png": 3.0}
    >>> round(fv.calibrate("bar", sizes).px_per_mm, 1)
    34.0
    """
    kind = one_of("kind", kind, KINDS)
    limits = {
        "plane_mm": plane_mm,
        "camera_distance_mm": camera_distance_mm,
        "tilt_deg": tilt_deg,
        "lens_relative": lens_relative,
        "edge_bias_px": edge_bias_px,
        "estimator_px": estimator_px,
        "temperature_k": temperature_k,
        "expansion_per_k": expansion_per_k,
    }
    stated = {name: None if value is None else number(name, value) for name, value in limits.items()}
    noted = Noted(certificate, date, response, dict(camera or {}))
    if kind in ("bar", "slot"):
        return on_sizes(references_of(pictures, kind), u_size_mm, region_of(roi), stated, noted)
    if kind == "scale":
        single = pictures if not isinstance(pictures, list | tuple) else _only(pictures)
        lines = (
            _needed("pitch_mm", pitch_mm, kind),
            number("u_line_mm", u_line_mm),
            number("u_length_mm", u_length_mm),
        )
        return on_lines(single, lines, region_of(roi), stated, noted)
    if roi is not None:
        raise ArgumentError("roi", "be left out for boards", f"is {roi!r}")
    board = _board(kind, squares, _needed("square_mm", square_mm, kind), u_square_mm, marker_mm)
    if not isinstance(pictures, list | tuple):
        raise ArgumentTypeError("pictures", "be a sequence of file names or arrays", f"is {what_it_is(pictures)}")
    if not pictures:
        raise ArgumentError("pictures", "be at least one picture", "is empty")
    return on_board(pictures, board, stated, noted)


def _board(kind: str, squares: Any, square_mm: float, u_square_mm: float | None, marker_mm: float | None) -> Board:
    if squares is None:
        raise ArgumentError("squares", f"be given for a {kind}", "is not", "two whole numbers such as (9, 6)")
    if isinstance(squares, str) or not hasattr(squares, "__len__") or len(squares) != 2:
        raise ArgumentError("squares", "be two whole numbers such as (9, 6)", f"is {squares!r}")
    columns, rows = (int(each) for each in squares)
    u_mm = U_SQUARE * square_mm if u_square_mm is None else number("u_square_mm", u_square_mm)
    if kind == "charuco":
        marker_mm = MARKER_SHARE * square_mm if marker_mm is None else number("marker_mm", marker_mm)
    elif marker_mm is not None:
        raise ArgumentError("marker_mm", "be left out for a chessboard", f"is {marker_mm:g}")
    return Board(columns, rows, square_mm, u_mm, marker_mm)


def _needed(argument: str, value: float | None, kind: str) -> float:
    if value is None:
        raise ArgumentError(argument, f"be given for a {kind}", "is not")
    return number(argument, value)


def _only(pictures: Sequence[Any]) -> Any:
    if len(pictures) != 1:
        raise ArgumentError("pictures", "be one picture of a line scale", f"are {len(pictures)}")
    return pictures[0]
