"""The calibrating commands: read pictures, call calib, write the calibration and its pictures, print the report."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fingervision import __version__
from fingervision.cli._bench_limits import limits_from
from fingervision.cli._picture_response import PictureResponse
from fingervision.cli._references import named_references, read_pictures, read_references, region_from
from fingervision.domain.errors import FingervisionError, UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from calib.measured_scale import Calibration


@contextmanager
def sentences() -> Iterator[None]:
    """Let calib's errors reach the user as this program's."""
    from calib.errors import CalibrationError

    try:
        yield
    except CalibrationError as error:
        raise FingervisionError(str(error)) from error


def calibrate_on_sizes(
    kind: str,
    items: Sequence[str],
    u_size_mm: float,
    roi: str | None,
    out: Path,
    certificate: str,
    date: str,
    response: str,
    camera: Sequence[str],
    no_picture: bool,
    as_json: bool,
    **limits: float | None,
) -> None:
    """Calibrate on bars and slots; arguments are the options of the commands."""
    with sentences():
        from calib.calibration_picture import picture_of_edges
        from calib.known_widths import find_widths
        from calib.measured_scale import Reference
        from calib.scale_from_sizes import MeasuredSize, scale_from_sizes
        from fingervision.cli import _calibration_report as report

        refuse_foreign(out)
        stored = read_references(items, kind, u_size_mm)
        read_with = PictureResponse.of(response, [path for _, path, _ in named_references(items, kind)])
        pictures = [replace(picture, grey=read_with.light(picture.grey)) for picture in stored]
        bench, stated = limits_from(limits, lens_calibrated=False)
        edges = find_widths(pictures, region_from(roi))
        shift_px = read_with.shift_px(stored, edges, region_from(roi))
        sizes = [
            MeasuredSize(
                Reference(f"{picture.kind} {picture.name}", picture.size_mm, picture.u_size_mm, certificate, date),
                edge.width_px,
                edge.u_width_px,
                edge.points_px,
                edge.light,
            )
            for picture, edge in zip(pictures, edges, strict=True)
        ]
        height, width = pictures[0].grey.shape
        fit = scale_from_sizes(sizes, (width, height), bench, stated, 0.0 if read_with.is_known else shift_px)
        calibration = written(read_with.noted(fit.calibration, shift_px), out, camera)
        if not no_picture:
            for picture, edge in zip(stored, edges, strict=True):
                words = f"{picture.name}: {picture.size_mm:g} mm = {edge.width_px:.3f} px"
                write_picture(out, picture.name, picture_of_edges(picture.grey, edge, words))
        if as_json:
            more = {
                "out": str(out),
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
            click.echo(json.dumps(report.as_json(calibration, more)))
            return
        lines = [*report.scale_lines(calibration), *report.sizes_lines(fit, edges), *report.budget_lines(calibration)]
        click.echo("\n".join([*lines, "", f"Written: {out}"]))


def calibrate_on_board(
    images: Sequence[Path],
    squares: str,
    square_mm: float,
    u_square_mm: float | None,
    marker_mm: float | None,
    out: Path,
    certificate: str,
    date: str,
    response: str,
    camera: Sequence[str],
    no_picture: bool,
    as_json: bool,
    **limits: float | None,
) -> None:
    """Calibrate on a board; arguments are the options of the commands."""
    with sentences():
        from calib.board import Board, find_corners
        from calib.calibration_picture import picture_of_corners
        from calib.scale_from_board import scale_from_board
        from fingervision.cli import _calibration_report as report

        refuse_foreign(out)
        columns, rows = _squares(squares)
        u_square = 0.001 * square_mm if u_square_mm is None else u_square_mm
        board = Board(columns, rows, square_mm, u_square, marker_mm)
        bench, stated = limits_from(limits, lens_calibrated=len(images) > 1)
        stored = read_pictures(images)
        read_with = PictureResponse.of(response, images)
        pictures = [read_with.light(grey) for grey in stored]
        corners = [find_corners(grey, board, path.name) for grey, path in zip(pictures, images, strict=True)]
        height, width = pictures[0].shape
        fit = scale_from_board(corners, board, (width, height), bench, stated)
        certified = tuple(replace(each, certificate=certificate, date=date) for each in fit.calibration.references)
        # A board's corners lie between equal edges on every side: a response does not move them.
        noted = read_with.noted(replace(fit.calibration, references=certified), 0.0)
        calibration = written(noted, out, camera)
        if not no_picture:
            residuals = [fit.plane.residual_px] if fit.lens is None else fit.lens.residual_px
            for grey, found, residual in zip(stored, corners, residuals, strict=True):
                words = f"{found.name}: {len(found.points_px)} corners"
                write_picture(out, found.name, picture_of_corners(grey, found.points_px, residual, words))
        if as_json:
            more = {
                "out": str(out),
                "rms_px": None if fit.lens is None else fit.lens.rms_px,
                "straightness_px": fit.straightness_px,
                "tilt_deg": fit.plane.tilt_deg,
            }
            click.echo(json.dumps(report.as_json(calibration, more)))
            return
        lines = [*report.scale_lines(calibration), *report.board_lines(fit), *report.budget_lines(calibration)]
        click.echo("\n".join([*lines, "", f"Written: {out}"]))


def _squares(squares: str) -> tuple[int, int]:
    try:
        columns, rows = (int(part) for part in squares.lower().split("x"))
    except ValueError:
        raise UsageError(f"--squares must be two whole numbers such as 9x6, but is {squares!r}.") from None
    return columns, rows


def refuse_foreign(out: Path) -> None:
    """Overwrite a calibration, never anything else."""
    if not out.exists():
        return
    try:
        content = json.loads(out.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        content = None
    if not (isinstance(content, dict) and "px_per_mm" in content):
        raise FingervisionError(f"{out} stands there already and is no calibration; name another file with -o.")


def written(calibration: "Calibration", out: Path, camera: Sequence[str]) -> "Calibration":
    """Write a calibration with the camera's settings, the date and the software; return it so."""
    from datetime import UTC, datetime

    from fingervision.storage.calibration_json import write_calibration

    settings = {}
    for setting in camera:
        name, equals, value = setting.partition("=")
        if not (name and equals):
            raise UsageError(f"--camera must be NAME=VALUE, but is {setting!r}.")
        settings[name] = value
    complete = replace(
        calibration,
        camera=settings,
        made_at=datetime.now(UTC).isoformat(timespec="seconds"),
        software=f"fingervision {__version__}",
    )
    write_calibration(complete, out)
    return complete


def write_picture(out: Path, name: str, picture: "NDArray[np.uint8]") -> None:
    """Write a calibration picture beside the calibration."""
    import cv2

    path = out.with_name(f"{out.stem}_{Path(name).stem}.png")
    written, content = cv2.imencode(".png", picture[:, :, ::-1])
    if written:
        try:
            path.write_bytes(content.tobytes())
        except OSError as error:
            raise FingervisionError(f"The picture {path} could not be written: {error.strerror}.") from error
