"""What stands beside the edges is learnt from a recording, and the gap is that between the fingers' own edges."""

from dataclasses import replace

import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.camera import ASSUMED_CAMERA, BesideEdges, CameraModel
from fingervision.domain.direction import Direction
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.camera_learning import camera_of
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, look_closely
from tests.benchmarks.camera_artefacts.classes import BELOW_PX
from tests.benchmarks.camera_artefacts.optics import Surface
from tests.benchmarks.unknown_cameras import CURVES, PX_PER_MM, Film, Recording, drawn, lossless, srgb

SURFACES = {"wall": Surface(wall_px=2.0), "glare": Surface(glare=0.4), "shadow": Surface(shadow=0.2)}


def errors(film: Film, recording: Recording, camera: CameraModel, *, only_steps: bool = False) -> np.ndarray:
    """Errors of the gap (first row) and their standard uncertainties."""
    found = []
    for frame, gap_px in zip(film, recording.gap_px, strict=True):
        outcome = look_closely(frame, Settings(BELOW_PX, Direction.UP, camera=camera), only_steps=only_steps)[0]
        assert isinstance(outcome, GapMeasurement)
        found.append((outcome.gap_px - gap_px, np.hypot(outcome.u_gap_px, outcome.u_picture_px)))
    return np.array(found).T


def learnt(film: Film, before: CameraModel = LINEAR_CAMERA) -> CameraModel:
    return camera_of(list(film), Settings(BELOW_PX, Direction.UP, camera=before), BareScale(PX_PER_MM))


@pytest.mark.parametrize(
    ("name", "before"),
    [
        ("wall", ASSUMED_CAMERA),
        *(pytest.param(name, ASSUMED_CAMERA, marks=pytest.mark.slow) for name in ("glare", "shadow")),
        *(pytest.param(name, LINEAR_CAMERA, marks=pytest.mark.slow) for name in ("glare", "shadow")),
    ],
)
def test_what_stands_beside_the_edges_is_learnt_and_taken_off(name: str, before: CameraModel) -> None:
    recording = drawn(9301, 5, SURFACES[name])
    film = lossless(recording, CURVES["linear"])
    camera = learnt(film, before)
    assert isinstance(camera.beside, BesideEdges)
    assert camera.beside.name == name
    error, u = errors(film, recording, camera)
    alone, _ = errors(film, recording, camera, only_steps=True)
    assert np.abs(alone).min() > 0.25, "nothing would be shown by this recording"
    assert np.all(np.abs(error) < 2.5 * u)
    assert np.abs(error).max() < np.abs(alone).min()


def test_a_deep_shadow_is_taken_off_the_whole_outline() -> None:
    """A shadow displaces a step by more or less on a rounded tip than on a flank."""
    recording = drawn(9311, 5, Surface(shadow=0.4))
    film = lossless(recording, CURVES["linear"])
    camera = learnt(film)
    assert camera.beside is not None
    assert camera.beside.name == "shadow"
    error, u = errors(film, recording, camera)
    alone, _ = errors(film, recording, camera, only_steps=True)
    assert np.abs(alone).min() > 0.25, "nothing would be shown by this recording"
    assert np.abs(error).max() < 0.1
    assert np.all(np.abs(error) < 2.0 * u)


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
def test_a_tone_curve_does_not_hide_what_stands_beside_the_edges(name: str) -> None:
    recording = drawn(9301, 5, SURFACES[name])
    film = lossless(recording, srgb)
    camera = learnt(film, ASSUMED_CAMERA)
    assert isinstance(camera.beside, BesideEdges)
    assert camera.beside.name == name
    error, u = errors(film, recording, camera)
    assert np.all(np.abs(error) < 2.5 * u)


def test_a_bare_edge_is_left_where_it_is() -> None:
    recording = drawn(9302, 5)
    film = lossless(recording, CURVES["linear"])
    camera = learnt(film, ASSUMED_CAMERA)
    assert camera.beside is None
    error, u = errors(film, recording, camera)
    assert np.all(np.abs(error) < 3.0 * u)


def test_a_clipped_ground_is_no_sign_of_anything_beside_the_edges() -> None:
    recording = drawn(9303, 5)
    brightest = max(light.max() for light in recording.light)
    film = lossless(
        replace(recording, light=tuple(1.02 / brightest * light for light in recording.light)), CURVES["linear"]
    )
    camera = learnt(film)
    assert camera.beside is None
