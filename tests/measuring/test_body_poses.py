"""Tracking of bodies: drawings placed by silhouette or by points, and mirrored, covered, absent or wrongly scaled
bodies.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.body_poses import COVERED, DAMAGED, NOT_FOUND, OK
from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.measuring.body_outlines import Placement, bending_of, outlines_of
from fingervision.measuring.body_poses import BodyTracker
from fingervision.measuring.drawing_placement import GivenPoint, by_points, by_silhouette, parse_point
from fingervision.models.finite_element import MechanismPlate
from fingervision.rendering import Camera, Patch, Scene, render
from fingervision.rendering.polygon import polygon
from fingervision.storage.bodies_csv import add_channels, write_bodies
from fingervision.storage.mechanism_toml import mechanism_from_tables, read_mechanism
from fingervision.vision.outline_chunks import PLAIN, ChunkEdges
from fingervision.vision.rigid_outline import _rigid as rigid_motion_of
from tests.deformed_plate import deformed_outlines
from tests.diagnosis.lever_drawing import TABLES

SCALE, WIDTH, HEIGHT = 5.0, 270, 500
PLACE = Placement(SCALE, np.array([24.3, 470.6]), 0.015, False)


@pytest.fixture(scope="module")
def plate() -> MechanismPlate:
    return MechanismPlate(mechanism_from_tables(TABLES, "lever"))


def frame(
    plate: MechanismPlate, u: float, number: int, place: Placement = PLACE, cover: tuple[Patch, ...] = (),
    size_px: tuple[int, int] = (WIDTH, HEIGHT),
) -> Frame:  # fmt: skip
    rng = np.random.default_rng(number)
    moved = u * plate.driven.unit_displacement
    nodes = plate.plate.nodes_mm + np.stack([moved[plate.plate.x_dofs], moved[plate.plate.y_dofs]])
    outlines = deformed_outlines(plate.plate.outline_edges, place.to_px(nodes))
    scene = Scene(width_px=size_px[0], height_px=size_px[1], before=(Patch(outlines, 50.0), *cover))
    return Frame(render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng), number, 0.1 * number)


def points(place: Placement, *at: tuple[float, float]) -> tuple[GivenPoint, ...]:
    found = []
    for x_mm, y_mm in at:
        x, y = place.to_px(np.array([[x_mm], [y_mm]]))[:, 0]
        found.append(GivenPoint(round(float(x)) + 1.0, round(float(y)) - 1.0, x_mm, y_mm))
    return tuple(found)


def test_the_pose_of_a_body_that_bends_is_that_of_its_area() -> None:
    """A stubby lever between its pivot, a spring and the drive: its edges alone are turned otherwise than its area."""
    drawing = Path(__file__).parents[1] / "benchmarks" / "mechanisms" / "films" / "lever_jaw.toml"
    lever, scale, u = MechanismPlate(read_mechanism(drawing)), 13.0, 0.15
    place = Placement(scale, np.array([186.3, 628.6]), 0.015, False)
    frames = [frame(lever, at, number, place, size_px=(560, 790)) for number, at in enumerate((0.0, u))]
    tracker = BodyTracker(lever.mechanism, BareScale(scale), points(place, (22, 8), (-12, 26), (-2, 46)))
    rest, seen = (each.poses["lever"] for each in tracker.poses(frames))
    u_mrad = float(np.hypot(*(np.sqrt(pose.random[2, 2]) for pose in (rest, seen))))
    assert u_mrad < 0.03
    assert seen.angle_mrad - rest.angle_mrad == pytest.approx(lever.state(u).bodies["lever"].angle_mrad, abs=3 * u_mrad)


def test_a_ground_that_bends_does_not_displace_the_drawing() -> None:
    """Its flexures do not load it in exactly the ratio that the model gives them; that must not turn the drawing."""
    drawing = Path(__file__).parents[1] / "benchmarks" / "mechanisms" / "films" / "lever_jaw.toml"
    lever, place = MechanismPlate(read_mechanism(drawing)), Placement(13.0, np.zeros(2), 0.0, False)
    ground = next(outline for outline in outlines_of(lever.mechanism) if outline.body.is_fixed)
    chunks = ground.chunks(place)
    moved = 0.8 * lever.driven.unit_displacement
    inside = place.to_mm(chunks.middles - 1e-3 * chunks.normals)
    seen = 13.0 * np.array([place.axes @ lever.motion_mm(moved, (x, y), large=False) for x, y in inside.T])
    offset = np.sum(chunks.normals * seen.T, axis=0)
    edges = ChunkEdges(offset, *np.full((4, offset.size), [[0.006**2], [1.0], [0.1], [1.0]]),
                       *np.ones((2, offset.size), dtype=bool))  # fmt: skip
    motion = rigid_motion_of(chunks, edges, ground.about_px(place), PLAIN)
    assert motion is not None
    u = np.sqrt(np.diag(motion[1]))
    assert np.all(np.abs(motion[0]) < 2.0 * u)
    assert u[0] < 0.006


def test_a_drawing_that_is_not_driven_is_followed_as_rigid_bodies() -> None:
    drawn = read_mechanism(Path("fingervision/models/mechanisms/parallel_leaf_stage.toml"))
    guided = replace(drawn.drives[0], across="held", turns="held")
    along_a_rail = replace(drawn, fixed=(), slides=((drawn.fixed[0], "y"),), drives=(guided,))
    assert bending_of(along_a_rail) is None
    assert bending_of(drawn) is not None


@pytest.mark.slow
def test_bodies_are_followed_through_deformed_pictures(plate: MechanismPlate, tmp_path: Path) -> None:
    inputs = (0.0, 0.3, 0.9)
    cover = Patch((polygon(((20.0, 300.0), (150.0, 300.0), (150.0, 480.0), (20.0, 480.0))),), 120.0)
    frames: list[Frame | LostFrame] = [frame(plate, u, k) for k, u in enumerate(inputs)]
    frames += [frame(plate, 0.9, 3, cover=(cover,)), LostFrame(4, 0.4, Status.DAMAGED, "cut off")]
    tracker = BodyTracker(plate.mechanism, BareScale(SCALE))
    seen = list(tracker.poses(frames))
    first = seen[0].poses
    for found, u in zip(seen[1:3], inputs[1:], strict=True):
        truth = plate.state(u).bodies
        for name, pose in truth.items():
            own, rest = found.poses[name], first[name]
            assert own.status == OK
            sigma = np.sqrt(np.diag(own.covariance) + np.diag(rest.covariance))
            moved = np.array([own.x_mm - rest.x_mm, own.y_mm - rest.y_mm, own.angle_mrad - rest.angle_mrad])
            assert np.all(np.abs(moved - (pose.x_mm, pose.y_mm, pose.angle_mrad)) < 5.0 * sigma + [1e-3, 1e-3, 0.02])
        turned = found.poses["hinge 1"].angle_mrad - first["hinge 1"].angle_mrad
        assert turned == pytest.approx(-1e3 * u / 17.0, rel=0.02)
    assert np.sqrt(first["finger"].random[2, 2]) < 0.05
    assert seen[3].poses["shuttle"].status == COVERED
    assert seen[3].poses["hinge 2"].status == COVERED
    assert seen[3].poses["finger"].status == OK
    assert {pose.status for pose in seen[4].poses.values()} == {DAMAGED}
    write_bodies(tmp_path / "bodies.csv", seen)
    lines = (tmp_path / "bodies.csv").read_text().splitlines()
    assert len(lines) == 1 + 5 * 5
    assert "nan" not in " ".join(lines)
    gaps = tmp_path / "gaps.csv"
    gaps.write_text("frame,time_s,status,gap_mm\n" + "".join(f"{k},,ok,1.0\n" for k in range(5)))
    add_channels(gaps, seen, {"finger": "finger", "hinge 1": "hinge_1"})
    header = gaps.read_text().splitlines()[0]
    assert header.startswith("frame,time_s,status,gap_mm,finger.x_mm,finger.y_mm,finger.angle_mrad,hinge_1.angle_mrad,")
    assert "u_finger.x_mm" in header


@pytest.mark.slow
def test_a_mirrored_picture_is_told_from_the_front(plate: MechanismPlate) -> None:
    mirrored = Placement(SCALE, np.array([246.0, 470.6]), np.pi - 0.015, True)
    grey = frame(plate, 0.0, 1, mirrored).pixels.astype(float)
    found = by_silhouette(grey, plate.mechanism, SCALE).place
    assert found.is_mirrored
    given = by_points(points(mirrored, (31, 0), (39, 0), (10, 90)), SCALE)
    assert given.is_mirrored
    assert np.allclose(given.to_px(np.array([[10.0], [90.0]])), mirrored.to_px(np.array([[10.0], [90.0]])), atol=3.0)


@pytest.mark.slow
def test_points_lay_the_drawing_where_half_of_it_is_out_of_view(plate: MechanismPlate) -> None:
    low = Placement(SCALE, np.array([24.3, 400.0]), 0.0, False)
    pictures = [frame(plate, u, k, low) for k, u in enumerate((0.0, 0.5))]
    tracker = BodyTracker(plate.mechanism, BareScale(SCALE), points(low, (31, 5), (39, 5), (10, 60)))
    seen = list(tracker.poses(pictures))
    moved = seen[1].poses["finger"].angle_mrad - seen[0].poses["finger"].angle_mrad
    assert moved == pytest.approx(plate.state(0.5).bodies["finger"].angle_mrad, abs=0.3)


@pytest.mark.slow
def test_a_drawing_that_is_not_in_the_picture_is_refused(plate: MechanismPlate) -> None:
    blank = np.random.default_rng(0).normal(128.0, 3.0, (HEIGHT, WIDTH))
    with pytest.raises(FingervisionError, match="cover"):
        by_silhouette(blank, plate.mechanism, SCALE)
    grey = frame(plate, 0.0, 1).pixels.astype(float)
    with pytest.raises(FingervisionError, match="overlap"):
        by_silhouette(grey, plate.mechanism, 2.5)
    wrong = points(Placement(SCALE, np.array([90.0, 380.0]), 0.3, False), (31, 5), (39, 5), (10, 60))
    tracker, pictures = BodyTracker(plate.mechanism, BareScale(SCALE), wrong), [frame(plate, 0.0, 1)]
    with pytest.raises(FingervisionError, match="edges"):
        list(tracker.poses(pictures))


@pytest.mark.parametrize("text", ["", "1,2", "1,2=3", "a,b=c,d", "1,2=3,4,5", "1;2=3;4", "nan,2=3,4", "1,inf=3,4"])
def test_a_point_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="X,Y=XMM,YMM"):
        parse_point(text)


def test_points_of_another_scale_or_at_one_place_are_refused() -> None:
    with pytest.raises(UsageError, match="two points"):
        by_points(points(PLACE, (31, 0)), SCALE)
    with pytest.raises(UsageError, match="px/mm"):
        by_points(points(PLACE, (31, 0), (10, 90)), 8.0)
    same = GivenPoint(10.0, 10.0, 1.0, 1.0)
    with pytest.raises(UsageError, match="same"):
        by_points((same, same), SCALE)


@pytest.mark.slow
def test_a_body_that_looks_alike_is_never_taken_for_one_that_is_hidden(plate: MechanismPlate) -> None:
    """The shuttle is covered by background, and a copy of the shuttle is drawn 1.5 mm away."""
    wide, own = ((13.0, 23.0, 9.0, 31.3), (15.5, 23.5, 10.0, 31.0))
    patches = []
    for (x0, x1, y0, y1), level in ((wide, Scene().light.ground), (own, 50.0)):
        corners = PLACE.to_px(np.array([[x0, x1, x1, x0], [y0, y0, y1, y1]]))
        patches.append(Patch((polygon(tuple((float(x), float(y)) for x, y in corners.T)),), level))
    frames = [frame(plate, 0.0, 0), frame(plate, 0.2, 1, cover=tuple(patches))]
    given = points(PLACE, (31, 0), (39, 0), (10, 90))
    seen = list(BodyTracker(plate.mechanism, BareScale(SCALE), given).poses(frames))
    assert seen[0].poses["shuttle"].status == OK
    assert seen[1].poses["shuttle"].status == seen[1].poses["hinge 2"].status == NOT_FOUND
    assert seen[1].poses["finger"].status == OK


def test_a_drawing_that_is_not_symmetric_is_not_called_so() -> None:
    drawing = Path(__file__).parents[1] / "benchmarks" / "mechanisms" / "films" / "lever_jaw.toml"
    lever, turned = MechanismPlate(read_mechanism(drawing)), float(np.radians(89.4))
    around = Placement(13.0, np.zeros(2), turned, False)
    place = replace(around, origin_px=np.array([400.0, 400.0]) - around.to_px(np.array([[7.0], [18.0]]))[:, 0])
    grey = np.asarray(frame(lever, 0.0, 0, place, size_px=(800, 800)).pixels, dtype=np.float64)
    placed = by_silhouette(grey, lever.mechanism, 13.0)
    assert not placed.notes
    assert placed.place.angle_rad == pytest.approx(turned, abs=0.02)
