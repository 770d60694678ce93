"""Poses of the gripper's bodies (both fingers and the drive), for every kind of model of a `gripper.toml`."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fingervision.domain.gripper import Gripper, Hinge, Lever, Links
from fingervision.models.driven_body import DrivenBody
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.mechanism_bodies import LinkBody, bodies_of, plate_poses
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.rigid_motion import BodyPose, rigid_motion
from fingervision.models.skeleton import Skeleton
from fingervision.models.static_answer import equilibria

Array = NDArray[np.float64]
Poses = Callable[[Array], Mapping[str, BodyPose]]

_MOST_EQUILIBRIA = 41
"""Most equilibria computed in the deformed shape: for the published sample a spline through 41 of them is within 0.02
um of a finer one."""
_RIGHT, _LEFT = "right_", "left_"
_MIRROR = np.array([-1.0, 1.0, -1.0])
_ON_AXIS = np.array([0.0, 1.0, 0.0])
"""Components of motion (x, y, rotation) kept for a body on the symmetry axis: it moves along the axis only, although
each of its halves alone would also bend sideways, against the other half."""


_KEPT: dict[tuple[Hinge, Lever, Links], tuple[LinkBody, ...]] = {}
_MOST_KEPT = 8
"""Number of drawings whose bodies are cached: all kinds of model of a drawing use the same bodies, which take half a
second to cut out."""


def gripper_bodies(gripper: Gripper) -> tuple[LinkBody, ...]:
    """Divide the right half of a gripper into its bodies."""
    outline = (gripper.hinge, gripper.lever, gripper.links)
    if outline not in _KEPT:
        while len(_KEPT) >= _MOST_KEPT:
            _KEPT.pop(next(iter(_KEPT)))
        _KEPT[outline] = bodies_of(half_mechanism(gripper))
    return _KEPT[outline]


def poses_of_plate(plate: PlaneStressPlate, gripper: Gripper, *, large: bool) -> Poses:
    """Poses of the right half's bodies from the displacements of its mesh."""
    return partial(plate_poses, plate, gripper_bodies(gripper), large=large)


def poses_of_frame(gripper: Gripper, skeleton: Skeleton, *, large: bool) -> Poses:
    """Poses of the right half's bodies from the motions of the nodes of the bars.

    A bar is represented by two rows of points at its sixths across its width, which give the bar's area and second
    moment.
    """
    members = skeleton.members
    owners = [_owner(member.name) for member in members]
    centroids = {body.name: body.centroid_mm for body in gripper_bodies(gripper) if not body.is_fixed}
    places = np.array([members[0].start_mm, *(member.end_mm for member in members)])

    def poses(moved: Array) -> Mapping[str, BodyPose]:
        motion = moved.reshape(-1, 3)
        found = {}
        for name, centroid in centroids.items():
            rest, there, weights = [], [], []
            for place, (member, owner) in enumerate(zip(members, owners, strict=True)):
                if owner != name or member.mass_t == 0.0:
                    continue
                a, b = member.parent + 1, place + 1
                # Simpson's rule along the bar; the displacement of its middle follows the cubic of a bent beam.
                chord = places[b] - places[a]
                bend = (motion[a, 2] - motion[b, 2]) / 8.0 * np.array([-chord[1], chord[0]])
                middle = 0.5 * (motion[a] + motion[b])
                middle[:2] += 0.0 if large else bend
                for share, at, by in ((1.0, places[a], motion[a]), (4.0, 0.5 * (places[a] + places[b]), middle),
                                      (1.0, places[b], motion[b])):  # fmt: skip
                    across = np.array([-chord[1], chord[0]]) / np.hypot(*chord) * member.width_mm / np.sqrt(12.0)
                    for side in (-1.0, 1.0):
                        arm = side * across
                        rest.append(at + arm)
                        there.append(by[:2] + _turned(arm, float(by[2]), large=large))
                        weights.append(share * member.mass_t)
            found[name] = rigid_motion(np.array(rest).T, np.array(there).T, np.array(weights), centroid, large=large)
        return found

    return poses


def gripper_poses(half: DrivenBody, physics: Physics, poses: Poses, input_mm: Array) -> dict[str, Array]:
    """Poses of both fingers and the drive at each input.

    Parameters
    ----------
    half : DrivenBody
        The right half.
    physics : Physics
        Which effects beyond small displacements are included.
    poses : callable
        Maps displacements of the half to the poses of its bodies.
    input_mm : ndarray of float, shape (n,)
        Inputs.

    Returns
    -------
    dict of str to ndarray of float, shape (n, 3)
        `x_mm`, `y_mm` and `angle_mrad` of every moving body; the left finger is the mirror image of the right one.
    """
    inputs = np.asarray(input_mm, dtype=float)
    if physics == LINEAR:
        right = {name: np.outer(inputs, row) for name, row in _rows(poses(half.unit_displacement_mm)).items()}
    else:
        nodes = np.unique(inputs)
        if nodes.size > _MOST_EQUILIBRIA:
            nodes = np.linspace(nodes[0], nodes[-1], _MOST_EQUILIBRIA)
        states = [_rows(poses(state.displacement_mm)) for state in equilibria(half, physics, nodes.tolist())]
        right = {name: _through(nodes, np.array([state[name] for state in states]), inputs) for name in states[0]}
    found: dict[str, Array] = {}
    for name, rows in right.items():
        if name.startswith(_RIGHT):
            found[_LEFT + name.removeprefix(_RIGHT)] = rows * _MIRROR
        found[name] = rows if name.startswith(_RIGHT) else rows * _ON_AXIS
    return {name: rows + 0.0 for name, rows in sorted(found.items())}  # no -0.0


def _rows(poses: Mapping[str, BodyPose]) -> dict[str, Array]:
    return {name: np.array([pose.x_mm, pose.y_mm, pose.angle_mrad]) for name, pose in poses.items()}


def _through(nodes: Array, rows: Array, inputs: Array) -> Array:
    if nodes.size == 1:
        return np.repeat(rows, inputs.size, axis=0)
    return np.asarray(PchipInterpolator(nodes, rows)(inputs))


def _owner(member: str) -> str:
    """Name of the body to which a bar of the half belongs; None for a bar of a hinge."""
    if member.startswith("hinge"):
        return ""
    if member in ("shuttle", "drive block"):
        return "drive"
    return "right_pillar" if member == "pillar" else "right_finger"


def _turned(arm: Array, angle: float, *, large: bool) -> Array:
    """Displacement of the far end of an arm that rotates about its other end."""
    if not large:
        return angle * np.array([-arm[1], arm[0]])
    c, s = np.cos(angle) - 1.0, np.sin(angle)
    return np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
