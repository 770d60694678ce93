"""Shared parts of the calibration commands: read options, call `fingervision.calibrate`, write and print its result."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from fingervision.cli._references import named_references, region_from
from fingervision.domain.errors import NoCalibrationError, UsageError


@contextmanager
def sentences() -> Iterator[None]:
    """Convert errors of the package `calib` to errors of fingervision with the same message."""
    from calib.errors import CalibrationError

    try:
        yield
    except CalibrationError as error:
        raise NoCalibrationError(str(error)) from error


def calibrate_on_sizes(kind: str, items: Sequence[str], roi: str | None, **options: Any) -> None:
    """Calibrate on bars and slots; the arguments are the options of the commands `bar` and `slot`."""
    pictures = [(path, size_mm, which) for which, path, size_mm in named_references(items, kind)]
    _calibrate(kind, pictures, roi=region_from(roi), **options)


def calibrate_on_board(kind: str, images: Sequence[Path], squares: str, **options: Any) -> None:
    """Calibrate on a chessboard or ChArUco board; the arguments are the options of these commands."""
    _calibrate(kind, list(images), squares=_squares(squares), **options)


def calibrate_on_lines(image: Path, roi: str | None, **options: Any) -> None:
    """Calibrate on a line scale; the arguments are the options of the command `scale`."""
    _calibrate("scale", image, roi=region_from(roi), **options)


def _calibrate(
    kind: str, pictures: Any, *, out: Path, camera: Sequence[str], no_picture: bool, as_json: bool, **options: Any
) -> None:
    from fingervision.interface.calibrate import calibrate
    from fingervision.interface.calibration_report import as_json as for_programs
    from fingervision.storage.calibration_json import refuse_foreign

    refuse_foreign(out)
    made = calibrate(kind, pictures, camera=_settings(camera), **options)
    made.save(out, pictures=not no_picture)
    if as_json:
        click.echo(json.dumps(for_programs(made.scale, {"out": str(out), **made.details})))
    else:
        click.echo(f"{made.report()}\n\nWritten: {out}")


def _settings(camera: Sequence[str]) -> dict[str, str]:
    settings = {}
    for setting in camera:
        name, equals, value = setting.partition("=")
        if not (name and equals):
            raise UsageError(f"--camera must be NAME=VALUE, but is {setting!r}.")
        settings[name] = value
    return settings


def _squares(squares: str) -> tuple[int, int]:
    try:
        columns, rows = (int(part) for part in squares.lower().split("x"))
    except ValueError:
        raise UsageError(f"--squares must be two whole numbers such as 9x6, but is {squares!r}.") from None
    return columns, rows
