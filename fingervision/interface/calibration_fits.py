"""Calibrate on each kind of reference: read its pictures, call calib, and keep the result with its notes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

from calib.board import Board, find_corners
from calib.calibration_picture import picture_of_corners, picture_of_edges, picture_of_lines
from calib.known_widths import find_widths
from calib.limits import Limits
from calib.line_scale import find_lines
from calib.measured_scale import Calibration as MeasuredScale
from calib.measured_scale import Reference as Certified
from calib.scale_from_board import scale_from_board
from calib.scale_from_lines import scale_from_lines
from calib.scale_from_sizes import MeasuredSize, scale_from_sizes
from fingervision import __version__
from fingervision.interface.calibration import Calibration, board_lines, line_details, line_lines, sizes_lines
from fingervision.interface.reference_pictures import PictureResponse, Reference, files_of, known_sizes, read_pictures

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
    pictures = [replace(picture, grey=read_with.light(picture.grey)) for picture in stored]
    bench, stated = limits_from(limits, lens_calibrated=False)
    edges = find_widths(pictures, region)
    shift_px = read_with.shift_px(stored, edges, region)
    sizes = [
        MeasuredSize.of(picture, edge, noted.certificate, noted.date)
        for picture, edge in zip(pictures, edges, strict=True)
    ]
    height, width = pictures[0].grey.shape
    fit = scale_from_sizes(sizes, (width, height), bench, stated, 0.0 if read_with.is_known else shift_px)
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


__all__ = ["LENS_LEFT", "Noted", "limits_from", "on_board", "on_lines", "on_sizes"]
