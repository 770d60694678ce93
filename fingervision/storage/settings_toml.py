"""File of measurement settings, which the browser page saves and commands read by `--settings`."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fingervision.domain.direction import Direction
from fingervision.domain.errors import OutputError
from fingervision.storage.durable import replaced
from fingervision.storage.plain_file import in_utf8
from fingervision.storage.toml_section import Section, read_document

SCHEMA = 1
TIPS = ("auto", *(direction.value for direction in Direction))
POLARITIES = ("auto", "dark", "light")
TOP_KEYS = ("schema", "calibration", "px_per_mm", "u_px_per_mm", "below_tip_mm", "tips", "roi", "fingers", "camera")
CAMERA_NUMBERS = ("rate_hz", "exposure_ms", "gain", "focus", "white_balance_k")
CAMERA_KEYS = (*CAMERA_NUMBERS, "size", "pixel_format")


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
    values, text = read_document(path, "settings")
    top = Section(path, text, "", values)
    top.only(TOP_KEYS)
    if top.values.get("schema") != SCHEMA:
        top.refuse("schema", f"must be {SCHEMA}, but is {top.values.get('schema')}.")
    if "calibration" in values and "px_per_mm" in values:
        top.refuse("px_per_mm", "and calibration both give the scale: leave one out.")
    found: dict[str, Any] = {}
    if "calibration" in values:
        found["calibration"] = path.parent / top.word("calibration")
    if "px_per_mm" in values:
        found["px_per_mm"] = top.number("px_per_mm", above=0.0)
    if "u_px_per_mm" in values:
        if "px_per_mm" not in values:
            top.refuse("u_px_per_mm", "needs the scale whose uncertainty it is: add px_per_mm.")
        found["u_px_per_mm"] = top.number("u_px_per_mm", above=0.0)
    if "below_tip_mm" in values:
        found["below_tip_mm"] = top.number("below_tip_mm", above=0.0)
    if "tips" in values:
        found["tips"] = top.word("tips", of=TIPS)
    if "fingers" in values:
        found["fingers"] = top.word("fingers", of=POLARITIES)
    if "roi" in values:
        box = values["roi"]
        if not (isinstance(box, list) and len(box) == 4 and all(type(side) is int and side >= 0 for side in box)):
            top.refuse("roi", f"must be four whole numbers [x, y, width, height], but is {box}.")
        found["roi"] = ",".join(str(side) for side in box)
    if "camera" in values:
        camera = top.table("camera")
        camera.only(CAMERA_KEYS)
        found["camera"] = {name: camera.number(name) for name in CAMERA_NUMBERS if name in camera.values}
        found["camera"] |= {name: camera.word(name) for name in ("size", "pixel_format") if name in camera.values}
    return found


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
    lines = [
        "# For `fingervision live SOURCE --settings FILE`, and for `measure`.",
        f"schema = {SCHEMA}",
    ]
    for key in TOP_KEYS[1:-1]:
        value = settings.get(key)
        if value is None:
            continue
        if isinstance(value, Path):
            value = Path(os.path.relpath(value.resolve(), path.parent.resolve())).as_posix()
        lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    camera = {key: value for key, value in (settings.get("camera") or {}).items() if value is not None}
    if camera:
        lines += ["", "[camera]", *(f"{key} = {json.dumps(value)}" for key, value in camera.items())]
    text = in_utf8(path, "\n".join(lines) + "\n")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replaced(path) as part:
            part.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path} could not be written ({error.strerror}): free disk space.") from error
