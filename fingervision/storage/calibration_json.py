"""The file calibration.json: a scale with its covariance, its uncertainty budget and its reference objects."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from math import isclose
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CURVES, CameraResponse, standard_response
from calib.errors import CalibrationError
from calib.lens import Lens
from calib.limits import Limits
from calib.measured_scale import Calibration, Reference, Response, ScalePart
from calib.plane import Plane
from fingervision.domain.errors import DataError, InputFileError, OutputError
from fingervision.storage.durable import replaced
from fingervision.storage.number_columns import is_number
from fingervision.storage.plain_file import json_of

# Values of a calibration file, checked one by one, and the calibration made from them.

Floats = NDArray[np.float64]

# Newest schema of calibration.json that this program reads, and the one that it writes.
SCHEMA = 1
# A standard uncertainty that occurs twice in the file (alone and in the covariance) may have been rounded by hand.
SAME_U = 0.01


class CalibrationReader:
    """Reader of the values of a calibration file, with error messages for invalid values.

    Parameters
    ----------
    path : Path
        The file, for the messages.
    content : object
        What the file holds, parsed from JSON.

    Raises
    ------
    DataError
        The content is not a JSON object with a schema.
    """

    def __init__(self, path: Path, content: object) -> None:
        self._path = path
        if not isinstance(content, dict) or "schema" not in content:
            self._refuse("it has no schema; make a calibration with `fingervision calibrate`")
        self._content: dict[str, Any] = content

    def _refuse(self, words: str) -> NoReturn:
        raise DataError(f"{self._path} is not a usable calibration: {words}.")

    def calibration(self) -> Calibration:
        """Return the calibration.

        Raises
        ------
        DataError
            The schema is newer than this program, a value is missing or not allowed, or two values contradict each
            other.
        """
        schema = self._content["schema"]
        if isinstance(schema, bool) or not isinstance(schema, int) or schema < 1:
            self._refuse(f"schema must be a whole number from 1, but is {schema!r}")
        if schema > SCHEMA:
            self._refuse(
                f"it has schema {schema}, but this program reads only schemas up to {SCHEMA}; use a newer fingervision"
            )
        budget = self._object("budget")
        limits, stated = self._limits(budget.get("limits"))
        try:
            return Calibration(
                px_per_mm=self._number(self._content, "px_per_mm", positive=True),
                edge_bias_px=self._number(self._content, "edge_bias_px"),
                parts=self._parts(budget),
                frame_size_px=(self._count("frame_width"), self._count("frame_height")),
                limits=limits,
                stated=stated,
                response=self._response(budget.get("response")),
                lens=self._lens(),
                plane=self._plane(),
                references=self._references(),
                camera={str(name): str(value) for name, value in self._object("camera").items()},
                made_at=self._text(self._content, "made_at"),
                software=self._text(self._content, "software"),
                camera_response=self._camera_response(),
                response_known=self._camera_response_content().get("known") is True,
                response_shift_px=self._response_shift_px(),
            )
        except CalibrationError as error:
            self._refuse(str(error).rstrip("."))

    def _camera_response_content(self) -> dict[str, Any]:
        content = self._object("budget").get("camera_response")
        if content is not None and not isinstance(content, dict):
            self._refuse(f"camera_response must be an object, but is {content!r}")
        return content or {}

    def _camera_response(self) -> CameraResponse | None:
        content = self._camera_response_content()
        name = self._text(content, "name")
        if not name:
            return None
        if content.get("level") is None:
            return standard_response(name)
        level, light = content["level"], content.get("light")
        size = len(level) if isinstance(level, list) else 0
        top = content.get("top_level")
        if top is not None and (isinstance(top, bool) or not isinstance(top, int) or top < 1):
            self._refuse(f"top_level of the response must be a whole number, but is {top!r}")
        return CameraResponse(
            name,
            self._array(level, "level of the response", (size,)),
            self._array(light, "light of the response", (size,)),
            top,
        )

    def _response_shift_px(self) -> float | None:
        content = self._camera_response_content()
        return None if content.get("shift_px") is None else self._number(content, "shift_px")

    def _object(self, name: str) -> dict[str, Any]:
        value = self._content.get(name)
        if value is None:
            return {}
        if not isinstance(value, dict):
            self._refuse(f"{name} must be an object, but is {value!r}")
        return value

    def _number(self, where: Mapping[str, Any], name: str, positive: bool = False) -> float:
        value = where.get(name)
        if not is_number(value) or (positive and not value > 0):  # type: ignore[operator] # a number, as just seen
            self._refuse(f"{name} must be a {'positive ' if positive else ''}number, but is {value!r}")
        return float(value)  # type: ignore[arg-type] # a number, as just seen

    def _count(self, name: str) -> int:
        value = self._content.get(name)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            self._refuse(f"{name} must be a whole number of pixels, but is {value!r}")
        return value

    def _text(self, where: Mapping[str, Any], name: str) -> str:
        value = where.get(name, "")
        if value is not None and not isinstance(value, str):
            self._refuse(f"{name} must be a text, but is {value!r}")
        return value or ""

    def _array(self, value: object, name: str, shape: tuple[int, ...]) -> Floats:
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            array = np.empty(0)
        if array.shape != shape or not np.all(np.isfinite(array)):
            self._refuse(f"{name} must be {' by '.join(map(str, shape))} numbers, but is {value!r}")
        return array

    def _covariance(self, value: object, name: str, size: int) -> Floats:
        covariance = self._array(value, name, (size, size))
        u = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        with np.errstate(over="ignore"):  # refused below
            correlation = covariance / np.maximum(np.outer(u, u), np.finfo(float).tiny)
        if not np.all(np.isfinite(correlation)):
            self._refuse(f"{name} must be symmetric and not negative, but is {value!r}")
        smallest = float(np.linalg.eigvalsh((correlation + correlation.T) / 2.0).min()) if covariance.any() else 0.0
        if np.any(np.diag(covariance) < 0.0) or not np.allclose(correlation, correlation.T) or smallest < -1e-6:
            self._refuse(f"{name} must be symmetric and not negative, but is {value!r}")
        return covariance

    def _parts(self, budget: Mapping[str, Any]) -> tuple[ScalePart, ...]:
        total = self._covariance(self._content.get("covariance"), "covariance", 2)
        for name, variance in (("u_px_per_mm", total[0, 0]), ("u_edge_bias_px", total[1, 1])):
            u = self._number(self._content, name)
            if u < 0.0 or not isclose(u, variance**0.5, rel_tol=0.5 * SAME_U, abs_tol=1e-9):
                self._refuse(f"{name} must be the root of its variance in covariance, {variance**0.5:g}, but is {u:g}")
        stated = budget.get("parts")
        if stated is None:
            return (ScalePart("scale and edge bias", total, "the calibration file"),)
        if not isinstance(stated, list) or not all(isinstance(part, dict) for part in stated):
            self._refuse(f"budget.parts must be a list of objects, but is {stated!r}")
        parts = tuple(
            ScalePart(
                self._text(part, "source"),
                self._covariance(part.get("covariance"), "budget.parts.covariance", 2),
                self._text(part, "from"),
            )
            for part in stated
        )
        added = np.sum([part.covariance for part in parts] or [np.zeros((2, 2))], axis=0)
        if not np.allclose(added, total, rtol=1e-6, atol=1e-18):
            self._refuse("the covariances of budget.parts must add up to covariance, but do not")
        return parts

    def _limits(self, stated: object) -> tuple[Limits, frozenset[str]]:
        # A file of another program may state no limits: the budget then consists of the covariance alone.
        nothing = {item.name: 0.0 for item in fields(Limits)} | {"camera_distance_mm": Limits().camera_distance_mm}
        if stated is None:
            return Limits(**nothing), frozenset()
        if not isinstance(stated, dict) or not all(isinstance(limit, dict) for limit in stated.values()):
            self._refuse(f"budget.limits must be an object of objects, but is {stated!r}")
        unknown = set(stated) - set(nothing)
        if unknown:
            self._refuse(f"budget.limits has an unknown limit, {sorted(unknown)[0]}")
        values = {name: self._number(limit, "value") for name, limit in stated.items()}
        try:
            limits = Limits(**(nothing | values))
        except CalibrationError as error:
            self._refuse(str(error).rstrip("."))
        return limits, frozenset(name for name, limit in stated.items() if limit.get("stated") is True)

    def _response(self, stated: object) -> Response:
        if stated is None:
            return Response()
        if not isinstance(stated, dict):
            self._refuse(f"budget.response must be an object, but is {stated!r}")
        return Response(
            lens=self._array(stated.get("lens"), "budget.response.lens", (2,)),
            tilt=self._array(stated.get("tilt"), "budget.response.tilt", (2, 2)),
        )

    def _lens(self) -> Lens | None:
        lens = self._object("lens")
        if not lens:
            return None
        if lens.get("model") != "brown":
            self._refuse(f"lens.model must be 'brown', but is {lens.get('model')!r}")
        parameters = self._array(lens.get("parameters"), "lens.parameters", (9,))
        if min(parameters[:2]) <= 0.0:
            self._refuse(f"the focal lengths in lens.parameters must be positive, but are {parameters[:2].tolist()}")
        return Lens(parameters, self._covariance(lens.get("covariance"), "lens.covariance", 9))

    def _plane(self) -> Plane | None:
        plane = self._object("plane")
        if not plane:
            return None
        homography = self._array(plane.get("homography"), "plane.homography", (3, 3))
        if abs(np.linalg.det(homography)) <= np.finfo(float).eps * np.abs(homography).max() ** 3:
            self._refuse(f"plane.homography must be invertible, but is {homography.tolist()}")
        return Plane(homography)

    def _references(self) -> tuple[Reference, ...]:
        stated = self._content.get("reference") or []
        if isinstance(stated, dict):
            stated = [stated]
        if not isinstance(stated, list) or not all(isinstance(reference, dict) for reference in stated):
            self._refuse(f"reference must be a list of objects, but is {stated!r}")
        return tuple(
            Reference(
                what=self._text(reference, "what"),
                size_mm=self._number(reference, "size_mm", positive=True),
                u_size_mm=self._number(reference, "u_size_mm"),
                certificate=self._text(reference, "certificate"),
                date=self._text(reference, "date"),
            )
            for reference in stated
        )


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
