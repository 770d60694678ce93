"""Frames: noise, light, bit depth, colour, and order of overlapping objects."""

from dataclasses import replace

import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.rendering.camera import IDEAL_CAMERA, Camera, RadialLens, Tilt
from fingervision.rendering.finger import Highlight
from fingervision.rendering.outline import disc
from fingervision.rendering.picture import exact_grey, render
from fingervision.rendering.scene import Light, LightStep, Patch, Rim, Scene, dust
from fingervision.rendering.targets import bar
from fingervision.rendering.truth import truth
from fingervision.rendering.two_fingers import two_fingers

# COVERED of test_coverage.py times 255 grey levels.
GREY = 1e-4
# The required accuracy of an edge.
EDGE_PX = 1e-3


def gap_by_area_px(grey: np.ndarray, row: int, ground: float = 200.0, fingers: float = 40.0) -> float:
    """Width of the gap in one row from its sum of grey levels: exact for upright edges, whatever the blur."""
    part = grey[row, 220:420]
    return float(((part - fingers) / (ground - fingers)).sum())


@pytest.mark.parametrize("light", [Light(200.0, 40.0), Light(40.0, 200.0)])
@pytest.mark.parametrize("bloom_px", [0.0, 0.25, 0.6])
def test_light_spreads_over_both_edges_of_the_gap(light: Light, bloom_px: float) -> None:
    grey = exact_grey(two_fingers(90.4, light=light), Camera(bloom_px=bloom_px))
    spread = 2 * bloom_px if light.ground > light.fingers else -2 * bloom_px
    assert abs(gap_by_area_px(grey, 300, light.ground, light.fingers) - (90.4 + spread)) < EDGE_PX


def test_blooming_behind_a_lens_is_still_in_picture_pixels() -> None:
    """A tilted plane changes the scale from row to row, but must not change the edge bias."""
    scene = two_fingers(90.4, tip_at_px=60.0)
    camera = Camera(tilt=Tilt(about_x_deg=30.0, distance_px=1000.0), lens=RadialLens(-0.02))
    plain, bloomed = exact_grey(scene, camera), exact_grey(scene, replace(camera, bloom_px=0.5))
    for row in (150, 240, 420):
        # The edges lean by less than 3 degrees there: 1/cos is 1 to 1.4e-3.
        assert gap_by_area_px(bloomed, row) - gap_by_area_px(plain, row) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("bloom_px", [0.0, 0.4, 0.9, 5.0, 60.0])
def test_light_that_spreads_over_all_of_a_dark_thing_swallows_it(bloom_px: float) -> None:
    """A grain of 1.5 px, a pin of 1.6 px and a disc of 8 px on a light background vanish one after the other."""
    rng = np.random.default_rng(2)
    for patches, half_width_px in [
        (dust(1, rng, size_px=(1.5, 1.5), levels=(20.0,)), 0.75),
        ((Patch(bar(1.6, 100.0, x_px=320.0, y_px=240.0, turn_deg=30.0), 20.0),), 0.8),
        ((Patch((disc(320.0, 240.0, 4.0),), 20.0),), 4.0),
    ]:
        grey = exact_grey(Scene(behind=patches), Camera(blur_px=0.5, bloom_px=bloom_px))
        assert grey.max() < 200.0 + GREY
        assert (grey.min() > 200.0 - GREY) == (bloom_px > half_width_px)


@pytest.mark.parametrize("rim", [None, Rim(5.0, 250.0)])
@pytest.mark.parametrize("bloom_px", [0.0, 0.5])
def test_touching_fingers_are_dark_all_through(rim: Rim | None, bloom_px: float) -> None:
    """Overlapping solids leave no seam and no doubled shade, even if both rims and both roots lie on common lines."""
    for gap_px in (4.0, 15.0, 16.0):
        grey = exact_grey(two_fingers(gap_px, radius_px=34.0, rim=rim), Camera(bloom_px=bloom_px))
        assert grey.min() > 40.0 - GREY
        assert np.max(np.abs(grey[300:, 235:405] - 40.0)) < GREY
        assert grey.max() < (250.0 if rim else 200.0) + GREY


@pytest.mark.parametrize("noise_grey", [1.0, 6.0])
def test_noise_is_white_and_has_its_size(noise_grey: float) -> None:
    camera = Camera(noise_grey=noise_grey, bits=16)
    noise = render(Scene(), camera, np.random.default_rng(5)) / 257.0 - 200.0
    # 307 200 pixels: the standard deviation scatters by 0.13 %, a correlation by 0.0018.
    assert noise.std() == pytest.approx(noise_grey, rel=0.006)
    assert abs(np.mean(noise[:, 1:] * noise[:, :-1])) / noise_grey**2 < 0.008
    assert abs(np.mean(noise[1:] * noise[:-1])) / noise_grey**2 < 0.008


def test_shot_noise_grows_with_the_root_of_the_light() -> None:
    camera = Camera(noise_grey=1.0, shot_grey=0.04, bits=16)
    for level in (50.0, 150.0):
        noise = render(Scene(light=Light(ground=level)), camera, np.random.default_rng(6)) / 257.0 - level
        assert noise.var() == pytest.approx(1.0 + 0.04 * level, rel=0.012)


def test_the_same_generator_gives_the_same_frame_and_no_noise_leaves_it_alone() -> None:
    scene, camera = two_fingers(50.0), Camera(noise_grey=2.0)
    one, two = (render(scene, camera, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, render(scene, camera, np.random.default_rng(8)))
    rng = np.random.default_rng(9)
    render(scene, IDEAL_CAMERA, rng)
    assert rng.random() == np.random.default_rng(9).random()


def test_bits_and_colour() -> None:
    scene, rng = two_fingers(50.0), np.random.default_rng(0)
    grey = exact_grey(scene, IDEAL_CAMERA)
    eight, sixteen = render(scene, Camera(bits=8), rng), render(scene, Camera(bits=16), rng)
    assert (eight.dtype, sixteen.dtype) == (np.uint8, np.uint16)
    assert np.max(np.abs(eight - grey)) <= 0.5
    assert np.max(np.abs(sixteen / 257.0 - grey)) <= 0.5 / 257.0 + GREY
    colour = render(scene, Camera(tint=(1.0, 0.9, 0.5)), rng)
    assert colour.shape == (480, 640, 3)
    assert np.max(np.abs(colour - grey[..., None] * (1.0, 0.9, 0.5))) <= 0.5


def test_exposure_clips_at_full_scale() -> None:
    scene = two_fingers(50.0, light=Light(200.0, 40.0, exposure=1.5))
    frame = render(scene, IDEAL_CAMERA, np.random.default_rng(0))
    assert frame.max() == 255
    assert frame.min() == 60
    assert exact_grey(scene, IDEAL_CAMERA).max() == pytest.approx(300.0, abs=1e-3)


def test_a_slope_runs_from_border_to_border() -> None:
    grey = exact_grey(Scene(light=Light(ground=100.0, slope_x=0.4, slope_y=-0.2)), IDEAL_CAMERA)
    assert grey[:, -1].mean() - grey[:, 0].mean() == pytest.approx(40.0 * 639 / 640)
    assert grey[-1].mean() - grey[0].mean() == pytest.approx(-20.0 * 479 / 480)
    assert grey.mean() == pytest.approx(100.0)


def test_a_step_lies_where_it_is_said_to() -> None:
    light = Light(ground=100.0, step=LightStep(0.5, at_px=20.0, towards_deg=90.0))
    grey = exact_grey(Scene(light=light), IDEAL_CAMERA)
    assert grey[:240].max() == pytest.approx(100.0, abs=GREY)
    assert grey[280:].min() == pytest.approx(50.0, abs=GREY)
    assert ((100.0 - grey[:, 0]) / 50.0).sum() == pytest.approx(479.5 - (239.5 + 20.0), abs=EDGE_PX)


def test_a_rim_lies_outside_the_edge_and_leaves_it_where_it_was() -> None:
    scene = two_fingers(90.4, rim=Rim(6.0, 250.0))
    row = exact_grey(scene, Camera(blur_px=0.5))[300]
    inner = 319.5 + 45.2
    assert row[round(inner + 20)] == pytest.approx(40.0, abs=GREY)
    assert row[round(inner - 3)] == pytest.approx(250.0, abs=1e-2)
    assert row[round(inner - 30)] == pytest.approx(200.0, abs=GREY)
    # From the middle of the rim to the finger's inside: the sum is the edge's place.
    first, last = round(inner - 3), round(inner + 20)
    assert first - 0.5 + ((row[first : last + 1] - 40.0) / 210.0).sum() == pytest.approx(inner, abs=EDGE_PX)


@pytest.mark.parametrize("rim_px", [0.7, 2.0, 5.0])
def test_a_rim_narrower_than_the_blur_keeps_its_area_and_the_edge_its_place(rim_px: float) -> None:
    row = exact_grey(two_fingers(90.4, rim=Rim(rim_px, 250.0)), Camera(blur_px=0.9))[300]
    inner = 319.5 + 45.2
    first, last = 340, 390
    light = 200.0 * (inner - rim_px - (first - 0.5)) + 250.0 * rim_px + 40.0 * (last + 0.5 - inner)
    assert (row[first : last + 1].sum() - light) / 160.0 == pytest.approx(0.0, abs=EDGE_PX)


@pytest.mark.parametrize("direction", Direction)
def test_a_highlight_lies_inside_each_finger(direction: Direction) -> None:
    plain = two_fingers(90.0, direction=direction, tilt_deg=5.0)
    lit = two_fingers(90.0, direction=direction, tilt_deg=5.0, highlight=Highlight(180.0))
    change = exact_grey(lit, IDEAL_CAMERA) - exact_grey(plain, IDEAL_CAMERA)
    assert change.max() == pytest.approx(140.0, abs=0.1)
    places = np.argwhere(change > 70.0)[:, ::-1].astype(float)
    inside = sum(finger.outline.winding(places) for finger in plain.fingers)
    assert inside.min() == 1.0
    # Two stripes of 8 x 120 px with round ends.
    assert len(places) == pytest.approx(2 * (8 * 112 + np.pi * 16), rel=0.02)


def test_things_behind_are_covered_by_the_fingers_and_dust_covers_everything() -> None:
    behind, speck = Patch((disc(260.0, 300.0, 30.0),), 120.0), Patch((disc(250.0, 300.0, 5.5),), 230.0)
    grey = exact_grey(two_fingers(90.0, behind=(behind,), before=(speck,)), IDEAL_CAMERA)
    assert grey[300, 282] == pytest.approx(120.0, abs=GREY)
    assert grey[300, 262] == pytest.approx(40.0, abs=GREY)
    assert grey[300, 250] == pytest.approx(230.0, abs=1e-3)


@pytest.mark.parametrize("camera", [IDEAL_CAMERA, Camera(blur_px=2.0, bloom_px=0.3)])
def test_the_four_directions_are_one_scene_turned(camera: Camera) -> None:
    def grey(direction: Direction) -> np.ndarray:
        outwards = direction in (Direction.DOWN, Direction.RIGHT)
        tip_at_px = 299.0 if outwards else 100.0
        scene = two_fingers(
            60.3, direction=direction, radius_px=20.0, tip_at_px=tip_at_px, tilt_deg=4.0, frame=(400, 400)
        )
        return exact_grey(scene, camera)

    up = grey(Direction.UP)
    assert np.max(np.abs(up[::-1] - grey(Direction.DOWN))) < GREY
    assert np.max(np.abs(up.T - grey(Direction.LEFT))) < GREY
    assert np.max(np.abs(up.T[:, ::-1] - grey(Direction.RIGHT))) < GREY


def test_the_scene_of_the_whole_list_has_its_truth() -> None:
    """A scene with all effects together is rendered without error, and its true gap is unchanged."""
    rng = np.random.default_rng(11)
    scene = two_fingers(
        120.0,
        radius_px=30.0,
        tilt_deg=(6.0, -8.0),
        tip_step_px=9.0,
        light=Light(210.0, 50.0, slope_x=0.4, slope_y=-0.1, step=LightStep(0.8, -40.0, 30.0)),
        behind=(Patch((disc(60.0, 60.0, 40.0),), 90.0),),
        before=dust(30, rng),
        rim=Rim(3.0, 250.0),
        highlight=Highlight(170.0),
    )
    camera = Camera(blur_px=1.5, noise_grey=6.0, shot_grey=0.02, bloom_px=0.2)
    frame = render(scene, camera, rng)
    assert frame.shape == (480, 640)
    true = truth(scene, camera, 10.2)
    assert not isinstance(true, NoGap)
    assert true.gap_px == pytest.approx(120.0, abs=1e-6)
