"""File of measurement settings, which the browser page saves and commands read by `--settings`."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from fingervision.domain.direction import Direction
from fingervision.domain.field import Field, names_of
from fingervision.storage.durable import written
from fingervision.storage.plain_file import in_utf8, toml_lines
from fingervision.storage.toml_section import read_section

TIPS = ("auto", *(direction.value for direction in Direction))
POLARITIES = ("auto", "dark", "light", "none")


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """The section [camera]."""

    rate_hz: Annotated[float | None, Field("frames per second", "Hz")] = None
    exposure_ms: Annotated[float | None, Field("exposure time", "ms")] = None
    gain: Annotated[float | None, Field("gain, in the unit of the camera")] = None
    focus: Annotated[float | None, Field("focus, in the unit of the camera")] = None
    white_balance_k: Annotated[float | None, Field("colour temperature of white", "K")] = None
    size: Annotated[str | None, Field("width and height of the picture, as `640x480`")] = None
    pixel_format: Annotated[str | None, Field("name of the pixel format")] = None


@dataclass(frozen=True, slots=True)
class Settings:
    """The file settings.toml."""

    schema: Annotated[int, Field("1", low=1, high=1)]
    calibration: Annotated[
        str | None, Field("the scale: name of a calibration file, relative to `settings.toml`; or `px_per_mm`")
    ] = None
    px_per_mm: Annotated[float | None, Field("the scale as a number", "px/mm", above=0.0)] = None
    u_px_per_mm: Annotated[float | None, Field("standard uncertainty of `px_per_mm`", "px/mm", above=0.0)] = None
    below_tip_mm: Annotated[float | None, Field("as the option of `measure`", "mm", above=0.0)] = None
    tips: Annotated[str | None, Field("as the option of `measure`", of=TIPS)] = None
    roi: Annotated[
        tuple[int, int, int, int] | None, Field("region [x, y, width, height] in the picture", "px", low=0)
    ] = None
    fingers: Annotated[str | None, Field("as the option of `measure`", of=POLARITIES)] = None
    camera: Annotated[CameraSettings | None, Field("settings of the camera (table below)")] = None


def read_settings(path: Path) -> dict[str, Any]:
    """Read settings as values of command options, by option name.

    Parameters
    ----------
    path : Path
        The TOML file; every key is optional.

    Returns
    -------
    dict
        Values by option name: `calibration` is a Path relative to the folder of the file, `roi` is the text that
        `--roi` accepts, and `camera` contains the settings of the camera.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or a key is unknown or has a value that is not allowed.
    """
    top = read_section(path, "settings")
    settings = top.record(Settings)
    if settings.calibration is not None and settings.px_per_mm is not None:
        top.refuse("px_per_mm", "and calibration both give the scale: leave one out.")
    if settings.u_px_per_mm is not None and settings.px_per_mm is None:
        top.refuse("u_px_per_mm", "needs the scale whose uncertainty it is: add px_per_mm.")
    found = _stated(settings)
    del found["schema"]
    if settings.calibration is not None:
        found["calibration"] = path.parent / settings.calibration
    if settings.roi is not None:
        found["roi"] = ",".join(map(str, settings.roi))
    if settings.camera is not None:
        found["camera"] = _stated(settings.camera)
    return found


def _stated(record: Any) -> dict[str, Any]:
    """Fields of a record that have a value."""
    return {name: value for name in names_of(record) if (value := getattr(record, name)) is not None}


def write_settings(path: Path, settings: Mapping[str, Any]) -> None:
    """Write settings to a file; settings that are None are omitted.

    Parameters
    ----------
    path : Path
        The file; an existing file is replaced once the new file is complete.
    settings : mapping
        Settings by key as in the file; `calibration` is a Path, `roi` four whole numbers, `camera` a mapping.

    Raises
    ------
    OutputError
        The file or folder cannot be written.
    """
    named = {name: settings.get(name) for name in names_of(Settings)} | {"schema": 1, "camera": None}
    if named["calibration"] is not None:
        relative = os.path.relpath(named["calibration"].resolve(), path.parent.resolve())
        named["calibration"] = Path(relative).as_posix()
    lines = ["# For `fingervision live SOURCE --settings FILE`, and for `measure`.", *toml_lines(named)]
    camera = {key: value for key, value in (settings.get("camera") or {}).items() if value is not None}
    lines += toml_lines(camera, "[camera]") if camera else []
    text = in_utf8(path, "\n".join(lines) + "\n")
    with written(path, "free disk space, or name another folder") as part:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text, encoding="utf-8")
