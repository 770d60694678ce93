"""Shadow, wall, glare and motion at the edges, drawn by the third renderer: corrected, or stated in the uncertainty."""

from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.frames.video_file import VideoFile
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, measure_frame
from fingervision.vision.single_picture import beside_in, measure_picture
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, SIZE_PX, Shot, glare, motion, plain, shadow, wall
from tests.benchmarks.camera_artefacts.electronics import stored
from tests.benchmarks.camera_artefacts.optics import Surface, light_on_sensor
from tests.benchmarks.camera_artefacts.scene import Finger, true_gap

KNOWN = Settings(BELOW_PX, Direction.UP, camera=LINEAR_CAMERA)
SAMPLE = Path(__file__).parents[2] / "sample_frames" / "opening" / "opening.mp4"
# Largest error a picture may have without saying so, and RMS over the few pictures of a test: three times what
# `python -m tests.benchmarks.camera_artefacts --told` prints for hundreds.
UNSAID_PX, FRAMES = 0.25, 5
CLASSES = {
    "shadow": (partial(shadow, share=0.2, over_px=6.0), 0.15),
    "long shadow": (partial(shadow, share=0.4, over_px=12.0), 0.6),
    "wall": (partial(wall, breadth_px=4.0), 0.5),
    "narrow wall": (partial(wall, breadth_px=1.3), 0.5),
    "glare": (partial(glare, inside_px=4.0), 0.5),
    "motion": (partial(motion, way_px=6.0), 0.3),
}


def measured(shot: Shot) -> GapMeasurement:
    found = measure_picture(Frame(shot.picture, 0), KNOWN)
    assert isinstance(found, GapMeasurement), found
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", CLASSES)
def test_what_stands_beside_the_edge(name: str) -> None:
    draw, rms_px = CLASSES[name]
    rng = np.random.default_rng([15, len(name)])
    errors = []
    for _ in range(FRAMES):
        shot = draw(rng)
        found = measured(shot)
        errors.append(found.gap_px - shot.gap_px)
        assert abs(errors[-1]) < max(UNSAID_PX, 2.0 * np.hypot(found.u_gap_px, found.u_shift_px))
    assert np.sqrt(np.mean(np.square(errors))) < rms_px


def test_motion_across_is_no_blur_of_round_tips() -> None:
    """If motion blur of the flanks were taken for defocus, the correction of a fillet would be wrong by twice the
    limit.
    """
    way_px, radius_px = 8.0, 27.0
    left, right = Finger(90.3, 98.2, 100.0, radius_px), Finger(340.7, 99.1, 100.0, radius_px)
    light = light_on_sensor((left, right), Surface(motion_px=(way_px, way_px)), 1.0, SIZE_PX, np.random.default_rng(1))
    found = measured(Shot(stored(light), true_gap(left, right, BELOW_PX)))
    taken_for_focus_px = way_px**2 / 12.0 / radius_px
    assert abs(found.gap_px - true_gap(left, right, BELOW_PX)) < 0.5 * taken_for_focus_px


@pytest.mark.parametrize("towards_gap_px", [2.5, -2.5])
def test_a_trail_of_earlier_pictures_is_stated(towards_gap_px: float) -> None:
    """A camera that mixes each picture with those before it shows moving fingers where they were."""
    rng, light, share = np.random.default_rng(2), 0.0, 0.45
    for ago in range(6):
        by_px = towards_gap_px * ago
        left, right = Finger(90.3 - by_px, 98.2, 100.0, 20.0), Finger(340.7 + by_px, 99.1, 100.0, 20.0)
        light = light + share**ago * (1.0 - share) * light_on_sensor((left, right), Surface(), 1.0, SIZE_PX, rng)
    noise = 1.5 / 255.0 * rng.standard_normal(np.shape(light))
    truth_px = true_gap(Finger(90.3, 98.2, 100.0, 20.0), Finger(340.7, 99.1, 100.0, 20.0), BELOW_PX)
    found = measured(Shot(stored(light + noise), truth_px))
    assert found.beside == "trail"
    assert abs(found.gap_px - truth_px) < 2.0 * np.hypot(found.u_gap_px, found.u_shift_px)


@pytest.mark.slow
@pytest.mark.parametrize("breadth_px", [1.4, 0.0])
def test_a_narrow_wall_is_stated_where_no_outer_flank_is_in_view(breadth_px: float) -> None:
    """A long fillet hides the profile of a wall: only the blur of the flanks, compared with the tips, indicates the
    wall.
    """
    left, right = Finger(25.3, 98.2, 300.0, 60.0, -0.8), Finger(424.7, 99.1, 300.0, 60.0, 0.8)
    truth_px, rng = true_gap(left, right, BELOW_PX), np.random.default_rng(3)
    light = light_on_sensor((left, right), Surface(wall_px=breadth_px), 1.0, SIZE_PX, rng)
    found = measured(Shot(stored(light + 2.0 / 255.0 * rng.standard_normal(light.shape)), truth_px))
    assert abs(found.gap_px - truth_px) < 2.0 * np.hypot(found.u_gap_px, found.u_shift_px)
    assert (found.u_shift_px > 0.0) == (breadth_px > 0.0)


def h264_clip(path: Path, breadth_px: float, frames: int) -> list[float]:
    """Write a lossy clip of opening fingers whose outer flanks are out of view, and return the true gaps."""
    rng, truth_px = np.random.default_rng(20), []
    with av.open(str(path), "w") as clip:
        stream = clip.add_stream("libx264", rate=25, options={"crf": "20"})
        stream.width, stream.height, stream.pix_fmt = *SIZE_PX, "yuv420p"
        for k in range(frames):
            left, right = (
                Finger(25.3 - 0.7 * k, 98.2, 300.0, 60.0, -0.8),
                Finger(424.7 + 0.7 * k, 99.1, 300.0, 60.0, 0.8),
            )
            truth_px.append(true_gap(left, right, BELOW_PX))
            light = light_on_sensor((left, right), Surface(wall_px=breadth_px), 1.0, SIZE_PX, rng)
            levels = stored(light + 2.0 / 255.0 * rng.standard_normal(light.shape)).astype(np.float64)
            luma = np.rint(16.0 + levels * 219.0 / 255.0).astype(np.uint8)
            chroma = np.full((SIZE_PX[1] // 2, SIZE_PX[0]), 128, np.uint8)
            picture = av.VideoFrame.from_ndarray(np.concatenate((luma, chroma)), format="yuv420p")
            clip.mux(stream.encode(picture))
        clip.mux(stream.encode())
    return truth_px


@pytest.mark.slow
@pytest.mark.parametrize("breadth_px", [1.4, 4.0])
def test_a_wall_in_a_lossy_clip_is_stated(breadth_px: float, tmp_path: Path) -> None:
    """Blur by the codec must not hide a wall, and a line at the picture's border must not be taken for a flank."""
    truth_px = h264_clip(tmp_path / "wall.mp4", breadth_px, 6)
    for frame, gap_px in zip(VideoFile(str(tmp_path / "wall.mp4")), truth_px, strict=True):
        assert isinstance(frame, Frame)
        found = measure_frame(frame, KNOWN)
        if isinstance(found, GapMeasurement):
            assert found.beside == "wall"
            assert abs(found.gap_px - gap_px) < 2.0 * np.hypot(found.u_gap_px, found.u_shift_px)


def test_the_sample_has_no_wall_where_its_outer_flanks_leave_the_picture() -> None:
    """The codec increases the squared blur of flanks relative to tips by up to 15 %, as its quantiser steps permit."""
    frames = islice(VideoFile(str(SAMPLE)), 98, 134)
    found = [measure_frame(frame, Settings(BELOW_PX)) for frame in frames if isinstance(frame, Frame)]
    assert [each.beside for each in found if isinstance(each, GapMeasurement)] == [""] * 36


@pytest.mark.parametrize("at_px", [0.0, 0.13, 0.3, 0.5])
def test_a_sharp_still_rectangle_does_not_move(at_px: float) -> None:
    """Sharp pictures, rendered by the covered share of each pixel: no motion is reported at any sub-pixel position."""
    picture = np.full((240, 320), 220.0)
    columns, rows = (np.arange(n)[:, None] + np.array([-0.5, 0.5]) for n in (320, 240))
    for left, right in ((40.2 + at_px, 110.0 + at_px), (190.0 - at_px, 262.3)):
        across = np.clip(np.minimum(columns[:, 1], right) - np.maximum(columns[:, 0], left), 0.0, 1.0)
        down = np.clip(rows[:, 1] - np.maximum(rows[:, 0], 80.0 + 0.5 * at_px), 0.0, 1.0)
        picture -= 180.0 * np.outer(down, across)
    rng = np.random.default_rng(int(100 * at_px))
    found = measured(Shot(stored((picture + 0.5 * rng.standard_normal(picture.shape)) / 255.0), 0.0))
    assert found.beside == ""
    assert abs(found.gap_px - (80.0 - 2.0 * at_px)) < 0.05


@pytest.mark.parametrize("breadth_px", [1.5, 4.0])
def test_a_wall_of_light_fingers_is_told_in_their_negative(breadth_px: float) -> None:
    rng = np.random.default_rng(5)
    shot = wall(rng, breadth_px)
    found = measured(Shot(255 - shot.picture, shot.gap_px))
    assert found.beside == "wall"
    assert abs(found.gap_px - shot.gap_px) < 2.0 * np.hypot(found.u_gap_px, found.u_shift_px)


@pytest.mark.parametrize("sigma_px", [0.7, 1.2])
def test_pixels_that_were_smoothed_are_no_sign_of_anything(sigma_px: float) -> None:
    """Shares of pixels that fingers cover, smoothed by a program: an edge's profile is a chain of straight pieces."""
    rows, columns = np.mgrid[0:240, 0:320].astype(float)
    rng = np.random.default_rng(6)
    left, right = 110.3 - 0.021 * (rows - 120.0), 190.2 + 0.017 * (rows - 120.0)
    free = np.clip(columns - left + 0.5, 0.0, 1.0) * np.clip(right - columns + 0.5, 0.0, 1.0)
    free += np.clip(columns - right - 79.5, 0.0, 1.0) + np.clip(left - columns - 69.5, 0.0, 1.0)
    free = np.maximum(free, rows < 60.0)
    smooth = cv2.GaussianBlur(40.0 + 180.0 * free, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE)
    picture = np.clip(np.rint(smooth + rng.standard_normal(smooth.shape)), 0, 255).astype(np.uint8)
    found = measured(Shot(picture, float((right - left)[70, 0])))
    assert found.u_picture_px < 0.1
    assert abs(found.gap_px - float((right - left)[70, 0])) < 0.05


def test_a_clean_edge_is_left_alone() -> None:
    rng = np.random.default_rng(8)
    assert all(measured(plain(rng, Surface())).u_shift_px == 0.0 for _ in range(2))


def test_a_wall_is_part_of_the_outline_where_that_is_asked() -> None:
    """The wall is visible on the inner side of both fingers: the gap of the outline is smaller by two wall widths."""
    rng = np.random.default_rng([15, 4])
    breadth_px, seen = 4.0, 0
    for _ in range(2):
        shot = wall(rng, breadth_px)
        frame = Frame(shot.picture, 0)
        camera = replace(LINEAR_CAMERA, beside=beside_in([frame], KNOWN))
        front, outline = (
            measure_frame(frame, replace(KNOWN, camera=camera, is_outline=is_outline)) for is_outline in (False, True)
        )
        assert isinstance(front, GapMeasurement)
        assert isinstance(outline, GapMeasurement)
        assert front.beside == outline.beside == "wall"
        u = np.hypot(outline.u_gap_px, outline.u_shift_px)
        assert abs(outline.gap_px - shot.gap_px + 2.0 * breadth_px) < max(UNSAID_PX, 2.0 * u)
        seen += front.gap_px - outline.gap_px > breadth_px
    assert seen == 2  # where the outer flank is out of view nothing is taken off, and the wall is stated
