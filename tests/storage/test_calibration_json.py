"""calibration.json: what is written is read back, and nonsense is refused with a sentence."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.camera_response import CameraResponse, standard_response
from calib.limits import Limits
from calib.measured_scale import Calibration, Reference, Response, ScalePart
from calib.projection import Lens, Plane
from fingervision.domain.errors import DataError, InputFileError, OutputError
from fingervision.storage.calibration_json import read_calibration, write_calibration


def calibration() -> Calibration:
    return Calibration(
        px_per_mm=34.0,
        edge_bias_px=-0.6,
        parts=(
            ScalePart("reference size", np.array([[4e-6, 2e-5], [2e-5, 4e-4]]), "the certificate"),
            ScalePart("reference edges", np.diag([1e-6, 1e-4]), "the fit"),
        ),
        frame_size_px=(640, 480),
        limits=Limits(plane_mm=0.2),
        stated=frozenset({"plane_mm"}),
        response=Response(np.array([20.0, -3.0]), np.array([[1.0, 0.1], [-2.0, 0.2]])),
        lens=Lens(
            np.array([800.0, 800, 320, 240, -0.1, 0.02, 0, 0, 0]), np.diag([1.0, 1, 1, 1, 1e-4, 1e-4, 1e-8, 1e-8, 0])
        ),
        plane=Plane(np.array([[1.01, 0.0, 1.0], [0.02, 0.99, 0.0], [1e-5, 0.0, 1.0]])),
        references=(Reference("bar ref5.png", 5.0, 0.001, "K-17", "2026-01-31"),),
        camera={"exposure_us": "200"},
        made_at="2026-02-01T12:00:00+00:00",
        software="fingervision 0",
    )


def test_everything_that_a_distance_needs_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    write_calibration(calibration(), path)
    read = read_calibration(path)
    points = np.array([[[100.0, 90.0], [180.0, 95.0]], [[400.0, 300.0], [600.0, 310.0]]])
    arguments = points, np.array([0.01, 0.02]), np.array([True, False])
    for mine, theirs in zip(
        (calibration().distances(*arguments), read.distances(*arguments)),
        (read.distances(*arguments), calibration().distances(*arguments)),
        strict=True,
    ):
        assert mine.value_mm == pytest.approx(theirs.value_mm, rel=1e-12)
        assert mine.u_mm == pytest.approx(theirs.u_mm, rel=1e-12)
    assert read.references == calibration().references
    assert read.stated == {"plane_mm"}
    content = json.loads(path.read_text())
    keys = (
        "schema px_per_mm u_px_per_mm edge_bias_px u_edge_bias_px covariance lens plane budget frame_width frame_height"
    )
    assert [*keys.split(), "reference", "camera", "made_at", "software"] == list(content)


def test_a_file_of_another_program_needs_no_budget(tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    bare = {"schema": 1, "px_per_mm": 34.0, "u_px_per_mm": 0.01, "edge_bias_px": 0.0, "u_edge_bias_px": 0.1}
    bare |= {"covariance": [[1e-4, 0], [0, 1e-2]], "lens": None, "plane": None, "budget": {}}
    path.write_text(json.dumps(bare | {"frame_width": 640, "frame_height": 480}))
    got = read_calibration(path).distances(np.array([[[0.0, 0.0], [34.0, 0.0]]]), np.array([0.0]), np.array([True]))
    assert got.u_mm is not None
    assert got.u_mm[0] == pytest.approx(np.hypot(0.01, 0.1) / 34.0)


# What no single field says; the limits of each field are tested in test_declared_formats.py.
NONSENSE: list[tuple[dict[str, Any], str]] = [
    ({"schema": 2}, "must be at most 1, but is 2: use a newer fingervision"),
    ({"px_per_mm": None}, "must state px_per_mm"),
    ({"u_px_per_mm": 0.5}, "u_px_per_mm in .* must be the root of its variance in covariance"),
    ({"u_px_per_mm": 1e300}, "u_px_per_mm in .* must be the root of its variance in covariance"),
    ({"covariance": [[-1e-4, 0.0], [0.0, 1e-2]]}, "covariance in .* must be symmetric and not negative"),
    ({"covariance": [[5e-6, 1.0], [1.0, 5e-4]]}, "covariance in .* must be symmetric and not negative"),
    ({"lens": {"model": "fisheye"}}, "lens.model in .* must be one of brown, but is 'fisheye'"),
    ({"plane": {"homography": [[0, 0, 0], [0, 0, 0], [0, 0, 0]]}}, "plane.homography in .* must be invertible"),
    ({"budget": []}, r"budget in .* must be a table \[budget\], but is"),
    ({"budget": {"limits": {"plane_mm": {"value": -1.0}}}}, "The limit plane_mm must be a number of zero or more"),
    ({"budget": {"limits": {"glare": {"value": 1.0}}}}, "budget.limits.glare in .* is not known"),
    ({"budget": {"parts": []}}, "budget.parts in .* must have covariances that add up to covariance"),
    (
        {"reference": [{"what": "bar", "size_mm": 0, "u_size_mm": 0}]},
        "size_mm in .* must be greater than 0 mm, but is 0",
    ),
]


@pytest.mark.parametrize(("edit", "sentence"), NONSENSE, ids=[str(edit)[:40] for edit, _ in NONSENSE])
def test_nonsense_is_refused(tmp_path: Path, edit: dict[str, Any], sentence: str) -> None:
    path = tmp_path / "calibration.json"
    write_calibration(calibration(), path)
    path.write_text(json.dumps(json.loads(path.read_text()) | edit))
    with pytest.raises(DataError, match=sentence) as caught:
        read_calibration(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{", "is not a calibration file: it is not JSON"),
        ('{"schema": 1, "px_per_mm": NaN}', "NaN is given where a number is needed"),
        ("[1, 2]", "it has no schema"),
        ("{}", "it has no schema"),
        ("\x00\xff", "it is not JSON"),
    ],
)
def test_what_is_no_calibration_file(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "calibration.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(DataError) as caught:
        read_calibration(path)
    assert sentence in str(caught.value)


def test_no_file_and_no_place(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="There is no calibration file"):
        read_calibration(tmp_path / "none.json")
    with pytest.raises(OutputError, match=r"could not be written .* name another place with -o"):
        write_calibration(calibration(), tmp_path / "none" / "calibration.json")


def test_other_frames_and_other_settings_are_refused() -> None:
    with pytest.raises(ValueError, match="made on frames of 640x480 pixels, but these are 1280x960"):
        calibration().check_frame_size(1280, 960)
    calibration().check_camera({"exposure_us": "200", "gain": "3"})
    with pytest.raises(ValueError, match="exposure_us = 200, but now exposure_us is 500"):
        calibration().check_camera({"exposure_us": "500"})


@pytest.mark.parametrize("is_standard", [True, False])
def test_the_camera_response_comes_back(tmp_path: Path, is_standard: bool) -> None:
    share = np.linspace(0.0, 1.0, 33)
    response = standard_response("srgb") if is_standard else CameraResponse("mine.csv", share, share**1.8, 4095)
    written = replace(calibration(), camera_response=response, response_known=True, response_shift_px=0.41)
    write_calibration(written, tmp_path / "calibration.json")
    read = read_calibration(tmp_path / "calibration.json")
    assert read.camera_response is not None
    assert (read.camera_response.name, read.camera_response.top_level) == (response.name, response.top_level)
    assert read.camera_response.light == pytest.approx(response.light)
    assert read.response_known
    assert read.response_shift_px == pytest.approx(0.41)


def test_a_file_without_limits_is_said_to_have_none(tmp_path: Path) -> None:
    plain = {"schema": 1, "px_per_mm": 28.3, "u_px_per_mm": 0.1, "edge_bias_px": 0.0, "u_edge_bias_px": 0.35}
    plain |= {"covariance": [[0.01, 0.0], [0.0, 0.1225]], "frame_width": 640, "frame_height": 480}
    (tmp_path / "bare.json").write_text(json.dumps(plain), encoding="utf-8")
    read = read_calibration(tmp_path / "bare.json")
    assert read.states_no_limits
    assert read.how_stated("plane_mm", "mm") == "0 mm (not in the calibration file)"
    plain["budget"] = {"limits": {"plane_mm": {"value": 0.5, "stated": True}}}
    (tmp_path / "limited.json").write_text(json.dumps(plain), encoding="utf-8")
    limited = read_calibration(tmp_path / "limited.json")
    assert not limited.states_no_limits
    assert limited.how_stated("plane_mm", "mm") == "+-0.5 mm (stated)"
