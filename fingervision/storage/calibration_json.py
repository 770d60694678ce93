"""The file calibration.json: a scale with its covariance, its uncertainty budget and its reference objects."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from math import isclose
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CURVES, CameraResponse, standard_response
from calib.errors import CalibrationError
from calib.limits import Limits
from calib.measured_scale import Calibration, Reference, Response, ScalePart
from calib.projection import Lens, Plane
from fingervision.domain.errors import DataError, InputFileError, OutputError
from fingervision.domain.field import Field
from fingervision.storage.durable import replaced
from fingervision.storage.plain_file import json_of
from fingervision.storage.toml_section import Section


def refuse_foreign(out: Path) -> None:
    """Refuse to overwrite a file that is not a calibration.

    Raises
    ------
    OutputError
        The path holds a file that is not a calibration.
    """
    if not out.exists():
        return
    try:
        content = json_of(out)
    except (OSError, ValueError):
        content = None
    if not (isinstance(content, dict) and "px_per_mm" in content):
        raise OutputError(f"{out} exists already and is not a calibration; name another file with -o.")


def write_picture(out: Path, name: str, picture: NDArray[np.uint8]) -> None:
    """Write a picture of a calibration (an RGB array) beside the calibration's file.

    Raises
    ------
    OutputError
        The file or folder cannot be written.
    """
    import cv2

    path = out.with_name(f"{out.stem}_{Path(name).stem}.png")
    written, content = cv2.imencode(".png", picture[:, :, ::-1])
    if written:
        try:
            path.write_bytes(content.tobytes())
        except OSError as error:
            raise OutputError(f"The picture {path} could not be written: {error.strerror}.") from error


Floats = NDArray[np.float64]

# Newest schema of calibration.json that this program reads, and the one that it writes.
SCHEMA = 1
# A standard uncertainty that occurs twice in the file (alone and in the covariance) may have been rounded by hand.
SAME_U = 0.01
COVARIANCE = "covariance of (px_per_mm, edge_bias_px)"


@dataclass(frozen=True, slots=True)
class LensFile:
    """The object `lens`."""

    model: Annotated[str, Field("`brown`", of=("brown",))]
    parameters: Annotated[
        Floats,
        Field("focal lengths, centre (px) and distortion: fx, fy, cx, cy, k1, k2, p1, p2, k3", shape=(9,)),
    ]
    covariance: Annotated[Floats, Field("covariance of the parameters", shape=(9, 9))]


@dataclass(frozen=True, slots=True)
class PlaneFile:
    """The object `plane`."""

    homography: Annotated[Floats, Field("perspective of the plane, determined with a board", shape=(3, 3))]


@dataclass(frozen=True, slots=True)
class ReferenceFile:
    """An object of the list `reference`."""

    size_mm: Annotated[float, Field("certified size", "mm", above=0.0)]
    u_size_mm: Annotated[float, Field("its standard uncertainty", "mm")]
    what: Annotated[str, Field("kind of object, and the name of its picture")] = ""
    certificate: Annotated[str, Field("name of the certificate")] = ""
    date: Annotated[str, Field("date of the certificate")] = ""


@dataclass(frozen=True, slots=True)
class ResponseFile:
    """The object `budget.response`."""

    lens: Annotated[Floats, Field("change of the references by the lens", shape=(2,))]
    tilt: Annotated[Floats, Field("change of the references by tilt, per radian about each axis", shape=(2, 2))]


@dataclass(frozen=True, slots=True)
class CameraResponseFile:
    """The object `budget.camera_response`."""

    name: Annotated[str, Field("standard response, or name of its file")] = ""
    known: Annotated[bool, Field("whether it was stated, not assumed")] = False
    shift_px: Annotated[float | None, Field("shift of an edge if another usual response holds", "px")] = None
    top_level: Annotated[int | None, Field("full scale of a picture; null for any", low=1)] = None
    level: Annotated[Floats | None, Field("curve of the response, where it is no standard one", shape=(-1,))] = None
    light: Annotated[Floats | None, Field("curve of the response, where it is no standard one", shape=(-1,))] = None


@dataclass(frozen=True, slots=True)
class CalibrationFile:
    """The file calibration.json."""

    schema: Annotated[int, Field("1", low=1)]
    px_per_mm: Annotated[float, Field("scale s", "px/mm", above=0.0)]
    u_px_per_mm: Annotated[float, Field("standard uncertainty of the scale", "px/mm", low=0.0)]
    edge_bias_px: Annotated[
        float,
        Field(
            "edge bias b in `gap_mm = (gap_px + b) / px_per_mm` for a light gap (for a dark gap, b has the opposite "
            "sign)",
            "px",
        ),
    ]
    u_edge_bias_px: Annotated[float, Field("standard uncertainty of the edge bias", "px", low=0.0)]
    covariance: Annotated[Floats, Field(COVARIANCE, shape=(2, 2))]
    frame_width: Annotated[
        int, Field("size of the calibration pictures; frames of another size are refused", "px", low=1)
    ]
    frame_height: Annotated[
        int, Field("size of the calibration pictures; frames of another size are refused", "px", low=1)
    ]
    lens: Annotated[LensFile | None, Field("null, or `model`, `parameters`, `covariance` (below)")] = None
    plane: Annotated[PlaneFile | None, Field("null, or the `homography` that was determined with a board")] = None
    reference: Annotated[tuple[ReferenceFile, ...], Field("list of reference objects (below)")] = ()
    made_at: Annotated[str, Field("time of the calibration")] = ""
    software: Annotated[str, Field("program and its version")] = ""


class _Reader:
    """Checks the parts of a calibration file against each other."""

    def __init__(self, path: Path, content: Mapping[str, Any]) -> None:
        stated = content.get("reference")
        values = {**content, "reference": [stated] if isinstance(stated, dict) else stated or []}
        self._top = Section(path, "", "", values, is_open=True)
        self._budget = self._table(self._top, "budget")

    def _table(self, section: Section, key: str) -> Section:
        return (
            section.table(key)
            if section.values.get(key) is not None
            else Section(section.path, "", section.dotted(key), {}, is_open=True)
        )

    def calibration(self) -> Calibration:
        """Return the calibration."""
        self._top.schema(SCHEMA)
        file = self._top.record(CalibrationFile)
        limits, stated = self._limits()
        response = self._table(self._budget, "response")
        camera = self._table(self._budget, "camera_response").record(CameraResponseFile)
        turned = response.record(ResponseFile) if response.values else None
        return Calibration(
            px_per_mm=file.px_per_mm,
            edge_bias_px=file.edge_bias_px,
            parts=self._parts(file),
            frame_size_px=(file.frame_width, file.frame_height),
            limits=limits,
            stated=stated,
            response=Response() if turned is None else Response(turned.lens, turned.tilt),
            lens=self._lens(file.lens),
            plane=self._plane(file.plane),
            references=tuple(Reference(**asdict(each)) for each in file.reference),
            camera={str(name): str(value) for name, value in self._table(self._top, "camera").values.items()},
            made_at=file.made_at,
            software=file.software,
            camera_response=self._camera_response(camera),
            response_known=camera.known,
            response_shift_px=camera.shift_px,
        )

    def _camera_response(self, stated: CameraResponseFile) -> CameraResponse | None:
        if not stated.name:
            return None
        if stated.level is None:
            return standard_response(stated.name)
        light = self._budget.table("camera_response").array("light", (stated.level.size,))
        return CameraResponse(stated.name, stated.level, light, stated.top_level)

    def _covariance(self, section: Section, key: str, covariance: Floats) -> Floats:
        u = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        with np.errstate(over="ignore"):  # refused below
            correlation = covariance / np.maximum(np.outer(u, u), np.finfo(float).tiny)
        is_finite = bool(np.all(np.isfinite(correlation)))
        smallest = (
            float(np.linalg.eigvalsh((correlation + correlation.T) / 2.0).min())
            if is_finite and covariance.any()
            else 0.0
        )
        is_symmetric = is_finite and np.allclose(correlation, correlation.T)
        if not is_symmetric or np.any(np.diag(covariance) < 0.0) or smallest < -1e-6:
            section.refuse(key, f"must be symmetric and not negative, but is {covariance.tolist()}.")
        return covariance

    def _parts(self, file: CalibrationFile) -> tuple[ScalePart, ...]:
        total = self._covariance(self._top, "covariance", file.covariance)
        pairs = (("u_px_per_mm", file.u_px_per_mm), ("u_edge_bias_px", file.u_edge_bias_px))
        for (name, u), variance in zip(pairs, np.diag(total).tolist(), strict=True):
            if not isclose(u, variance**0.5, rel_tol=0.5 * SAME_U, abs_tol=1e-9):
                self._top.refuse(
                    name, f"must be the root of its variance in covariance, {variance**0.5:g}, but is {u:g}."
                )
        if self._budget.values.get("parts") is None:
            return (ScalePart("scale and edge bias", total, "the calibration file"),)
        parts = tuple(
            ScalePart(
                part.word("source", ""),
                self._covariance(part, "covariance", part.array("covariance", (2, 2))),
                part.word("from", ""),
            )
            for part in self._budget.tables("parts")
        )
        added = np.sum([part.covariance for part in parts] or [np.zeros((2, 2))], axis=0)
        if not np.allclose(added, total, rtol=1e-6, atol=1e-18):
            self._budget.refuse("parts", "must have covariances that add up to covariance, but has not.")
        return parts

    def _limits(self) -> tuple[Limits, frozenset[str]]:
        # A file of another program may state no limits: the budget then consists of the covariance alone.
        values = {item.name: 0.0 for item in fields(Limits)} | {"camera_distance_mm": Limits().camera_distance_mm}
        limits = self._table(self._budget, "limits")
        limits.only(values)
        tables = {name: limits.table(name) for name in limits.values}
        values |= {name: table.number("value") for name, table in tables.items()}
        return Limits(**values), frozenset(name for name, table in tables.items() if table.flag("stated"))

    def _lens(self, lens: LensFile | None) -> Lens | None:
        if lens is None:
            return None
        if min(lens.parameters[:2]) <= 0.0:
            self._top.refuse("lens", f"must have positive focal lengths, but has {lens.parameters[:2].tolist()}.")
        return Lens(lens.parameters, self._covariance(self._top.table("lens"), "covariance", lens.covariance))

    def _plane(self, plane: PlaneFile | None) -> Plane | None:
        if plane is None:
            return None
        h = plane.homography
        if abs(np.linalg.det(h)) <= np.finfo(float).eps * np.abs(h).max() ** 3:
            self._top.table("plane").refuse("homography", f"must be invertible, but is {h.tolist()}.")
        return Plane(h)


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
    if not isinstance(content, dict) or "schema" not in content:
        raise DataError(
            f"{path} is not a usable calibration: it has no schema; make a calibration with `fingervision calibrate`."
        )
    try:
        return _Reader(path, content).calibration()
    except CalibrationError as error:
        raise DataError(f"{path} is not a usable calibration: {str(error).rstrip('.')}.") from error
