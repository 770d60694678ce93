"""`fingervision.calibrate`: pixels to millimetres from a reference, with the uncertainty budget."""

from collections.abc import Mapping, Sequence
from typing import Any

from calib.board import Board
from fingervision.domain.errors import ArgumentError, ArgumentTypeError
from fingervision.frames.array_levels import what_it_is
from fingervision.interface.argument_checks import number, one_of, region_of, speaks_python
from fingervision.interface.calibration import Calibration
from fingervision.interface.calibration_fits import Noted, on_board, on_lines, on_sizes
from fingervision.interface.reference_pictures import references_of

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


__all__ = ["KINDS", "calibrate"]
