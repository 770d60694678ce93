"""Flexures limit the distance of the bodies that they join: a body measured elsewhere was mistaken."""

import numpy as np
import pytest

from fingervision.domain.body_poses import OK, SeenPose
from fingervision.measuring.joined_bodies import Joint, torn_off
from fingervision.models.mechanism_bodies import bodies_of
from fingervision.storage.mechanism_toml import mechanism_from_tables
from tests.diagnosis.lever_drawing import TABLES

SMALL = np.diag([1e-6, 1e-6, 1e-4])


@pytest.fixture(scope="module")
def joints() -> list[Joint]:
    mechanism = mechanism_from_tables(TABLES, "lever")
    bodies = {body.name: body for body in bodies_of(mechanism)}
    first, second = mechanism.flexures
    return [Joint(first, (bodies["pillar"], bodies["finger"])), Joint(second, (bodies["shuttle"], bodies["finger"]))]


def seen(joints: list[Joint], **moves: tuple[float, float, float] | None) -> dict[str, SeenPose]:
    """Poses of bodies rotated (rad) about a point; all other bodies are at rest."""
    poses = {}
    for name in ("pillar", "shuttle", "finger"):
        move = moves.get(name, (0.0, 0.0, 0.0))
        poses[name] = SeenPose("covered") if move is None else SeenPose(
            OK, move[0], move[1], 1e3 * move[2], SMALL, SMALL
        )  # fmt: skip
    return poses


def about_hinge(joints: list[Joint], turn: float) -> dict[str, tuple[float, float, float]]:
    """A possible motion of the mechanism: the finger rotates about the first hinge and lifts the shuttle."""
    (pillar_hinge, shuttle_hinge), finger = (np.array(j.flexure.at_mm) for j in joints), joints[0].bodies[1]
    c, s = np.cos(turn), np.sin(turn)

    def moved(point: np.ndarray) -> np.ndarray:
        x, y = point - pillar_hinge
        return np.array([c * x - s * y, s * x + c * y]) + pillar_hinge - point

    return {"finger": (*moved(finger.centroid_mm), turn), "shuttle": (*moved(shuttle_hinge), 0.0)}


@pytest.mark.parametrize("turn", [-0.3, -0.1, 0.0, 0.1, 0.3])
def test_what_the_mechanism_can_do_is_not_torn(joints: list[Joint], turn: float) -> None:
    assert torn_off(joints, seen(joints, **about_hinge(joints, turn))) == set()


@pytest.mark.parametrize("turn", [-0.1, 0.2])
@pytest.mark.parametrize("step", [(3.0, 0.0), (-3.0, 0.0), (0.0, 3.0), (0.0, -3.0), (6.0, 2.0)])
def test_a_body_beside_its_place_is_told(joints: list[Joint], turn: float, step: tuple[float, float]) -> None:
    moves = about_hinge(joints, turn)
    x, y, own = moves["finger"]
    assert torn_off(joints, seen(joints, **{**moves, "finger": (x + step[0], y + step[1], own)})) == {"finger"}
    x, y, own = moves["shuttle"]
    assert torn_off(joints, seen(joints, **{**moves, "shuttle": (x + step[0], y + step[1], own)})) == {"shuttle"}


def test_of_two_free_bodies_apart_neither_is_believed(joints: list[Joint]) -> None:
    assert torn_off(joints[1:], seen(joints, shuttle=(5.0, 0.0, 0.0))) == {"finger", "shuttle"}


def test_a_body_that_was_not_seen_tears_nothing(joints: list[Joint]) -> None:
    assert torn_off(joints, seen(joints, finger=None)) == set()
    assert torn_off(joints, seen(joints, shuttle=None, finger=(5.0, 0.0, 0.0))) == {"finger"}


def test_a_pose_that_is_not_known_well_tears_nothing(joints: list[Joint]) -> None:
    poses = seen(joints, finger=(3.0, 0.0, 0.0))
    vague = np.diag([1.0, 1.0, 1.0])
    assert torn_off(joints, {**poses, "finger": SeenPose(OK, 3.0, 0.0, 0.0, vague, vague)}) == set()
