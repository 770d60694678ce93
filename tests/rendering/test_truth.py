"""The true gap: closed forms, every direction, and agreement with the rendered picture."""

from dataclasses import replace
from math import hypot, radians, sqrt, tan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingervision.domain.direction import Direction
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.rendering.camera import IDEAL_CAMERA, Camera, RadialLens, Tilt, View
from fingervision.rendering.finger import EllipticTip, SquareTip
from fingervision.rendering.picture import exact_grey
from fingervision.rendering.scene import Scene
from fingervision.rendering.truth import TrueGap, truth
from fingervision.rendering.two_fingers import two_fingers

# What the truth is promised to.
TRUTH_PX = 1e-6
# A rendered edge against its outline: the required accuracy.
EDGE_PX = 1e-3

BELOW_TIP_PX = 10.2


def true_gap(scene: Scene, camera: Camera = IDEAL_CAMERA, below_tip_px: float = BELOW_TIP_PX) -> TrueGap:
    found = truth(scene, camera, below_tip_px)
    assert isinstance(found, TrueGap), found
    return found


@settings(deadline=None, max_examples=60)
@given(
    # A sharp finger that leans into the gap by more than atan(10.2/102) is met on its slanted end, and its inner corner
    # stands up to 42 px further in below: narrower gaps would be closed by it.
    gap_px=st.floats(100.0, 220.0),
    direction=st.sampled_from(Direction),
    radius_px=st.floats(0.0, 51.0),
    tilts=st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0)),
    step_px=st.floats(-15.0, 15.0),
    centre_px=st.floats(-5.0, 5.0),
)
def test_two_fingers_have_the_gap_they_were_asked_for(
    gap_px: float,
    direction: Direction,
    radius_px: float,
    tilts: tuple[float, float],
    step_px: float,
    centre_px: float,
) -> None:
    scene = two_fingers(
        gap_px, direction=direction, radius_px=radius_px, tilt_deg=tilts, tip_step_px=step_px, centre_px=centre_px
    )
    true = true_gap(scene)
    assert abs(true.gap_px - gap_px) < TRUTH_PX
    outwards = 1.0 if direction in (Direction.DOWN, Direction.RIGHT) else -1.0
    assert abs(true.right.tip_px - true.left.tip_px - outwards * step_px) < TRUTH_PX
    along = [(edge.y_px if direction.is_vertical else edge.x_px) - edge.tip_px for edge in (true.left, true.right)]
    assert along == pytest.approx([-outwards * BELOW_TIP_PX] * 2, abs=TRUTH_PX)
    across = [edge.x_px if direction.is_vertical else edge.y_px for edge in (true.left, true.right)]
    middle = (639 if direction.is_vertical else 479) / 2 + centre_px
    assert sum(across) / 2 == pytest.approx(middle, abs=TRUTH_PX)


@settings(deadline=None)
@given(radius_px=st.floats(11.0, 51.0))
def test_a_round_tip_stands_back_by_its_sagitta(radius_px: float) -> None:
    scene = two_fingers(100.0, radius_px=radius_px)
    straight_px = scene.fingers[1].outline.box_px[0] - scene.fingers[0].outline.box_px[2]
    sagitta = radius_px - sqrt(radius_px**2 - (radius_px - BELOW_TIP_PX) ** 2)
    assert straight_px == pytest.approx(100.0 - 2 * sagitta, abs=TRUTH_PX)


@pytest.mark.parametrize("direction", Direction)
def test_a_measuring_point_on_the_joint_of_arc_and_side_is_found(direction: Direction) -> None:
    """Once, although rounding puts the joint on either side of the line; every place of the tip rounds anew."""
    for tip_at_px in np.random.default_rng(4).uniform(100.0, 300.0, 40):
        scene = two_fingers(103.0, radius_px=BELOW_TIP_PX, direction=direction, tip_at_px=float(tip_at_px))
        assert true_gap(scene).gap_px == pytest.approx(103.0, abs=TRUTH_PX)


@settings(deadline=None)
@given(tilt_deg=st.floats(0.1, 10.0))
def test_the_tip_of_a_tilted_sharp_finger_is_its_outermost_corner(tilt_deg: float) -> None:
    """The measuring height is measured along the picture's axis, not the finger's: on a tilted finger the inner corner
    rises.
    """
    left = true_gap(two_fingers(100.0, tilt_deg=(-tilt_deg, 0.0))).left
    outline = two_fingers(100.0, tilt_deg=(-tilt_deg, 0.0)).fingers[0].outline
    corner = min((piece.start for piece in outline.pieces), key=lambda point: point[1])
    assert left.tip_px == pytest.approx(corner[1], abs=TRUTH_PX)
    assert left.x_px - corner[0] == pytest.approx(BELOW_TIP_PX * tan(radians(tilt_deg)), abs=TRUTH_PX)


@pytest.mark.parametrize("direction", Direction)
@pytest.mark.parametrize("blur_px", [0.3, 0.9, 3.0, 5.0])
def test_the_drawn_half_level_of_a_straight_edge_lies_at_the_truth(direction: Direction, blur_px: float) -> None:
    """Edge in the rendered frame, by the closed form for the pixel next to the edge."""
    scene = two_fingers(100.37, below_tip_px=60.0, direction=direction, tip_at_px=200.0)
    true = true_gap(scene, below_tip_px=60.0)
    grey = exact_grey(scene, Camera(blur_px=blur_px))
    if not direction.is_vertical:
        grey = grey.T
    edges = [
        (edge.x_px, edge.y_px) if direction.is_vertical else (edge.y_px, edge.x_px) for edge in (true.left, true.right)
    ]
    for (across, along), outwards in zip(edges, (-1, 1), strict=True):
        # From inside the finger to the middle of the gap: the dark pixels' sum is the edge's place.
        row = (200.0 - grey[round(along)]) / 160.0
        middle = round((edges[0][0] + edges[1][0]) / 2)
        inside = round(across) + outwards * 45
        if outwards < 0:
            place = inside - 0.5 + row[inside : middle + 1].sum()
        else:
            place = inside + 0.5 - row[middle : inside + 1].sum()
        assert abs(place - across) < EDGE_PX


def test_lens_and_tilt_move_the_truth_with_the_picture() -> None:
    camera = Camera(lens=RadialLens(-0.06, 0.01), tilt=Tilt(8.0, -12.0, 2500.0))
    scene = two_fingers(180.0, radius_px=30.0, tilt_deg=(4.0, -6.0), tip_step_px=7.0)
    true = true_gap(scene, camera)
    view = View(RadialLens(-0.06, 0.01), Tilt(8.0, -12.0, 2500.0), 640, 480)
    t = np.linspace(0.0, 1.0, 20_001)
    for finger, edge in zip(scene.fingers, (true.left, true.right), strict=True):
        points = np.concatenate([view.points(piece.points(t)) for piece in finger.outline.pieces])
        # Sampled every 0.03 px or less, a round tip is found to h^2 / 8R.
        assert points[:, 1].min() == pytest.approx(edge.tip_px, abs=1e-5)
        nearest = points[np.argmin(np.hypot(points[:, 0] - edge.x_px, points[:, 1] - edge.y_px))]
        assert np.hypot(*(nearest - (edge.x_px, edge.y_px))) < 0.03
        assert edge.y_px - edge.tip_px == pytest.approx(BELOW_TIP_PX, abs=TRUTH_PX)
    assert abs(true.gap_px - true_gap(scene).gap_px) > 0.5


def test_the_rest_of_the_camera_does_not_move_the_truth() -> None:
    scene = two_fingers(50.0, radius_px=30.0)
    assert true_gap(scene, Camera(blur_px=4.0, bloom_px=0.5, noise_grey=9.0)) == true_gap(scene)


@pytest.mark.parametrize("tip", [SquareTip(5.0, 12.0), EllipticTip(60.0), EllipticTip(51.0)])
def test_other_tips_have_their_gap_too(tip: SquareTip | EllipticTip) -> None:
    assert true_gap(two_fingers(80.0, tip=tip, tilt_deg=3.0)).gap_px == pytest.approx(80.0, abs=TRUTH_PX)


def test_different_tip_heights_make_the_gap_slanted() -> None:
    true = true_gap(two_fingers(50.0, tip_step_px=30.0))
    assert true.right.x_px - true.left.x_px == pytest.approx(40.0, abs=TRUTH_PX)
    assert hypot(40.0, 30.0) == pytest.approx(true.gap_px, abs=TRUTH_PX)


def test_a_notch_that_is_open_at_the_measuring_height_is_a_gap() -> None:
    scene = two_fingers(15.0, radius_px=34.0)
    assert scene.fingers[0].outline.box_px[2] > scene.fingers[1].outline.box_px[0]
    assert true_gap(scene).gap_px == pytest.approx(15.0, abs=TRUTH_PX)


@pytest.mark.parametrize(
    ("scene", "status"),
    [
        (two_fingers(-3.0, radius_px=20.0), Status.TOUCHING),
        (two_fingers(0.0), Status.TOUCHING),
        (Scene(), Status.NO_FINGERS),
        (replace(two_fingers(50.0), fingers=two_fingers(50.0).fingers[:1]), Status.ONE_FINGER),
        (two_fingers(50.0, tip_at_px=-20.0), Status.TIP_OUT_OF_VIEW),
        (two_fingers(50.0, centre_px=-320.0), Status.TIP_OUT_OF_VIEW),
        # At the measuring height the edges are in view, the outermost points are not.
        (two_fingers(600.0, radius_px=51.0), Status.TIP_OUT_OF_VIEW),
    ],
)
def test_where_there_is_no_gap_there_is_a_reason(scene: Scene, status: Status) -> None:
    found = truth(scene, IDEAL_CAMERA, BELOW_TIP_PX)
    assert isinstance(found, NoGap)
    assert found.status is status
    assert found.words.endswith(".")
