"""One half of the gripper as a frame structure: tree members become elements, with masses lumped at nodes."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags

from fingervision.domain.gripper import Gripper
from fingervision.models.corotational_frame import CorotationalFrame
from fingervision.models.driven_body import DrivenBody
from fingervision.models.finger_body import finger_body, is_of_finger
from fingervision.models.hinge_compliance import bar_compliance
from fingervision.models.joined_frame import JoinedFrame
from fingervision.models.skeleton import Skeleton

Array = NDArray[np.float64]

_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])
_STIFF_JOINT = 1e-3
"""Compliance of a rigid joint relative to that of a square bar of the joint's length: small, yet well conditioned."""


def frame_of(gripper: Gripper, skeleton: Skeleton) -> CorotationalFrame:
    """Convert a tree of members to a frame of beam elements."""
    members = skeleton.members
    nodes = np.array([members[0].start_mm, *(member.end_mm for member in members)])
    ends = np.array([(member.parent + 1, place + 1) for place, member in enumerate(members)])
    compliance = np.array([_end_compliance(gripper, nodes[b] - nodes[a], place, skeleton)
                           for place, (a, b) in enumerate(ends.tolist())])  # fmt: skip
    return CorotationalFrame(nodes, ends, compliance)


def joined_frame_of(gripper: Gripper, skeleton: Skeleton) -> JoinedFrame:
    """Convert a tree of members to beam elements, except the finger, which becomes one elastic body."""
    body, bars = finger_body(gripper, skeleton), frame_of(gripper, skeleton)
    places = np.array([place for place, member in enumerate(skeleton.members) if not is_of_finger(member.name)])
    elements = CorotationalFrame(bars.nodes_mm, bars.ends[places], bars.end_compliance[places])
    return JoinedFrame(bars.nodes_mm, bars.ends, places, elements, body)


def half_frame(
    gripper: Gripper, skeleton: Skeleton, frame: CorotationalFrame | JoinedFrame | None = None
) -> DrivenBody:
    """Apply supports and drive to the frame of the right half.

    The clamp is fixed. The drive point moves by the input along the symmetry axis, and can neither move sideways nor
    rotate.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    skeleton : Skeleton
        Tree of members of the drawing.
    frame : CorotationalFrame or None
        Frame made from the tree; None makes it.
    """
    frame = frame or frame_of(gripper, skeleton)
    nodes, ends = frame.nodes_mm, frame.ends
    drive = 3 * (skeleton.drive + 1)
    held = [0, 1, 2, drive, drive + 2]
    driven = np.array([drive + 1])
    face = np.array([3 * (skeleton.corner + 1), 3 * (skeleton.heel + 1)])
    return DrivenBody(
        stiffness_n_mm=frame.stiffness_n_mm(),
        assemble_mass=lambda: _mass_t(nodes, ends, skeleton, frame),
        tangent=frame.internal_force_n,
        driven=driven,
        free=np.setdiff1d(np.arange(frame.unknowns), [*held, *driven]),
        swaying=np.setdiff1d(np.arange(frame.unknowns), [0, 1, 2, *driven]),
        face=face,
        face_rest_mm=np.array([gripper.tip_corner_mm[0], gripper.tip_heel_mm[0]]),
        measured=np.array([3 * (skeleton.measured + 1)]),
        weights=np.ones(1),
        measured_rest_mm=gripper.measuring_point_mm[0],
        nodes=3 * np.arange(len(nodes))[:, None] + np.arange(2),
        nodes_mm=nodes,
    )


def _end_compliance(gripper: Gripper, axis_mm: Array, place: int, skeleton: Skeleton) -> Array:
    compliance = skeleton.members[place].compliance[_PLANAR]
    if compliance.any():
        return compliance
    length = float(np.hypot(*axis_mm))
    return _STIFF_JOINT * bar_compliance(length, length, gripper.body.plate_mm, gripper.material)[_PLANAR]


def _mass_t(
    nodes: Array, ends: NDArray[np.int64], skeleton: Skeleton, frame: CorotationalFrame | JoinedFrame
) -> csr_matrix:
    """Mass matrix: half of each member's mass at each end, corrected to a uniform bar's rotational inertia.

    The mass matrix is equation (2) of Hricko & Havlik (2015), with mass m and moment of inertia I_z for each node: I_z
    of a bar about its centre is m (l^2 + w^2) / 12 for length l and width w. An elastic body that replaces members has
    its own mass matrix.
    """
    mass, inertia = np.zeros(len(nodes)), np.zeros(len(nodes))
    body = frame.body if isinstance(frame, JoinedFrame) else None
    for member, (a, b) in zip(skeleton.members, ends.tolist(), strict=True):
        if body is not None and is_of_finger(member.name):
            continue
        length2 = float(np.sum((nodes[b] - nodes[a]) ** 2))
        for node in (a, b):
            mass[node] += 0.5 * member.mass_t
            inertia[node] += 0.5 * member.mass_t * (length2 + member.width_mm**2) / 12.0
    columns = np.stack([mass, mass, inertia], axis=1)
    whole = csr_matrix(diags(columns.ravel()))
    if body is None:
        return whole
    dofs = body.unknowns
    entries = (body.mass_t.ravel(), (np.repeat(dofs, dofs.size), np.tile(dofs, dofs.size)))
    return csr_matrix(whole + coo_matrix(entries, shape=whole.shape))
