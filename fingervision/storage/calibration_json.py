"""The file calibration.json: a scale with its covariance, its uncertainty budget and its reference objects."""

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from calib.camera_response import CURVES
from calib.limits import Limits
from calib.measured_scale import Calibration
from fingervision.domain.errors import DataError, InputFileError, OutputError
from fingervision.storage.calibration_reader import SCHEMA, CalibrationReader
from fingervision.storage.durable import replaced
from fingervision.storage.plain_file import json_of


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Write a calibration; if writing fails, no incomplete file remains.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    limits = {
        item.name: {
            "value": getattr(calibration.limits, item.name),
            "stated": item.name in calibration.stated,
        }
        for item in fields(Limits)
    }
    lens, plane = calibration.lens, calibration.plane
    content = {
        "schema": SCHEMA,
        "px_per_mm": calibration.px_per_mm,
        "u_px_per_mm": calibration.u_px_per_mm,
        "edge_bias_px": calibration.edge_bias_px,
        "u_edge_bias_px": calibration.u_edge_bias_px,
        "covariance": calibration.covariance.tolist(),
        "lens": None
        if lens is None
        else {
            "model": "brown",
            "parameters": lens.parameters.tolist(),
            "covariance": lens.covariance.tolist(),
        },
        "plane": None if plane is None else {"homography": plane.homography.tolist()},
        "budget": {
            "limits": limits,
            "parts": [
                {"source": part.source, "covariance": part.covariance.tolist(), "from": part.supplied}
                for part in calibration.parts
            ],
            "response": {"lens": calibration.response.lens.tolist(), "tilt": calibration.response.tilt.tolist()},
            "camera_response": _response_content(calibration),
        },
        "frame_width": calibration.frame_size_px[0],
        "frame_height": calibration.frame_size_px[1],
        "reference": [asdict(reference) for reference in calibration.references],
        "camera": dict(calibration.camera),
        "made_at": calibration.made_at,
        "software": calibration.software,
    }
    try:
        with replaced(path) as part:
            part.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(
            f"The calibration could not be written to {path}: {error.strerror}; name another place with -o."
        ) from error


def _response_content(calibration: Calibration) -> dict[str, Any] | None:
    response = calibration.camera_response
    if response is None:  # a stated scale has no calibration pictures, and therefore no shift by their response
        return None if calibration.response_shift_px is None else {"shift_px": calibration.response_shift_px}
    is_standard = response.name in CURVES
    return {
        "name": response.name,
        "known": calibration.response_known,
        "shift_px": calibration.response_shift_px,
        "top_level": response.top_level,
        "level": None if is_standard else response.level.tolist(),
        "light": None if is_standard else response.light.tolist(),
    }


def read_calibration(path: Path) -> Calibration:
    """Read a calibration, and refuse invalid content.

    Raises
    ------
    DataError, InputFileError
        The file does not exist, has a newer schema, or its values are inconsistent.
    """
    try:
        content = json_of(path)
    except FileNotFoundError:
        raise InputFileError(f"There is no calibration file {path}; make one with `fingervision calibrate`.") from None
    except OSError as error:
        raise InputFileError(f"The calibration file {path} could not be read: {error.strerror}.") from error
    except ValueError as error:
        raise DataError(f"{path} is not a calibration file: it is not JSON ({error}).") from error
    return CalibrationReader(path, content).calibration()
