"""Outlines of a drawing's bodies, divided into short pieces, and the placement of the drawing in the picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.models.condensed_bodies import CondensedBody
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import MRAD, BodyPose, LinkBody, bodies_of, body_weights, rigid_motion
from fingervision.vision.outline_chunks import REACH_PX, Chunks, FlatMap

Array = NDArray[np.float64]

CHUNK_PX = 24.0
"""Length of the pieces (chunks) into which an outline is divided: long enough to estimate the blur, and short enough
that a chunk is usually covered completely or not at all.
"""
FROM_CORNERS_PX = 4.0
"""Distance of chunks from corners, where the blur of the adjoining edge matters: three times a blur of 1.2 px."""
BESIDE = 1e-4
RIGID = 1e-9
"""Share of a body's largest stiffness below which its frames move as one."""
OTHER_LOADS = 0.1
"""How the loads of flexures on a body differ from those of the drawing, relative to them: flexures that are printed or
cut differ by some per cent in stiffness, as do the model's, and the loads' directions change as the mechanism moves."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Position, rotation and scale of the drawing in the picture.

    Parameters
    ----------
    px_per_mm : float
        Pixels per millimetre.
    origin_px : ndarray of float, shape (2,)
        Position of the drawing's origin in the picture.
    angle_rad : float
        Direction of the drawing's x axis in the picture, from the picture's x towards its y.
    is_mirrored : bool
        Whether the picture shows the back of the drawing: its y axis then points to the right of its x axis in the
        picture, instead of to the left.
    flat : FlatMap or None
        Lens distortion and perspective of the picture; origin and angle are then those in the undistorted plane.
    """

    px_per_mm: float
    origin_px: Array
    angle_rad: float
    is_mirrored: bool
    flat: FlatMap | None = None

    @property
    def axes(self) -> Array:
        """Unit vectors of the drawing's axes in the picture, as columns."""
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        # The picture's y axis points downwards, whereas the y axis of a drawing seen from its front points upwards.
        side = 1.0 if self.is_mirrored else -1.0
        return np.array([[c, -side * s], [s, side * c]])

    def to_flat_px(self, points_mm: Array) -> Array:
        """Convert points of the drawing, shape (2, n), to the plane without perspective and distortion."""
        return np.asarray(self.origin_px[:, None] + self.px_per_mm * self.axes @ points_mm)

    def to_px(self, points_mm: Array) -> Array:
        """Convert points of the drawing, shape (2, n), to pixels of the picture."""
        flat = self.to_flat_px(points_mm)
        return flat if self.flat is None else self.flat.to_picture(flat)

    def to_mm(self, points_px: Array) -> Array:
        """Convert points of the picture, shape (2, n), to the coordinates of the drawing."""
        flat = points_px if self.flat is None else self.flat.to_flat(points_px)
        return np.asarray(self.axes.T @ (flat - self.origin_px[:, None]) / self.px_per_mm)

    @property
    def turn_sign(self) -> float:
        """Sign of a rotation in the drawing that corresponds to a positive rotation in the picture."""
        return float(np.sign(np.linalg.det(self.axes)))


@dataclass(frozen=True, slots=True, eq=False)
class Bending:
    """How the bodies of a mechanism bend as it is driven, beside their rigid motions.

    Without it, a body's pose would be that of the edges that happen to be seen, and a bent edge would count as a wrong
    one: the pose of a stubby lever was off by 0.5 mrad, fifty times its uncertainty.

    Parameters
    ----------
    model : MechanismFrame
        Elastic model of the drawing.
    moved : ndarray of float, shape (unknowns, k)
        Its small displacements by each drive, at the input at which its flexures yield, and by other loads of the
        flexures on each body.
    poses : mapping of str to tuple of BodyPose
        Pose of every moving body in each of them; those of fixed bodies are zero.
    """

    model: MechanismFrame
    moved: Array
    poses: Mapping[str, tuple[BodyPose, ...]]

    def of(self, body: LinkBody, chunks: Chunks, place: Placement) -> Chunks:
        """Add to the chunks of a body how each moves outwards as the body bends."""
        at_mm = place.axes.T @ (chunks.middles - place.origin_px[:, None]) / place.px_per_mm
        outward = place.axes.T @ chunks.normals
        inside_mm = at_mm - BESIDE * self.model.mechanism.region.size_mm * outward
        shape = (at_mm.shape[1], 2, self.moved.shape[1])
        moved_mm = np.reshape(
            [self.model.motion_mm(self.moved, (x, y), large=False) for x, y in inside_mm.T.tolist()], shape
        )
        x, y = at_mm - body.centroid_mm[:, None]
        for k, pose in enumerate(self.poses.get(body.name, ())):
            turn = pose.angle_mrad / MRAD
            moved_mm[:, :, k] -= np.stack([pose.x_mm - turn * y, pose.y_mm + turn * x], axis=1)
        bends = place.px_per_mm * np.einsum("in,nik->nk", outward, moved_mm)
        return replace(chunks, bends=bends[:, np.any(bends, axis=0)])


def bending_of(mechanism: Mechanism) -> Bending | None:
    """Compute how the bodies of a drawing bend; None for a drawing that cannot be computed as it is driven."""
    try:
        model = MechanismFrame(mechanism)
        if not model.stiffness_n_mm:  # a drive that bends nothing is refused here, as no input makes flexures yield
            return None
        driven = model.driven.unit_by_drive * model.input_at_yield_mm
    except FingervisionError:
        return None
    moved = np.hstack([driven, *(_by_other_loads(model, body, driven) for body in model.assembly.bodies)])
    plate = model.plate
    fields = model.assembly.small_field(moved)
    nodes = np.stack([fields[plate.x_dofs], fields[plate.y_dofs]])
    poses = {
        name: tuple(rigid_motion(plate.nodes_mm, nodes[:, :, k], areas, centroid, large=False)
                    for k in range(moved.shape[1]))
        for name, (areas, centroid) in body_weights(plate, model.bodies).items()
    }  # fmt: skip
    return Bending(model, moved, poses)


def _by_other_loads(model: MechanismFrame, body: CondensedBody, driven: Array) -> Array:
    """Motions of the frames, shape (unknowns, n), by which one body alone bends in each way that loads can bend it.

    Each way stores the same strain energy. Together they are how far a body bends whose elastic energy is known, but
    whose loads are not: a normal distribution with the inverse of its stiffness as covariance.
    """
    rows = ~np.isin(body.unknowns, model.assembly.held)
    own = body.unknowns[rows]
    stiffness = body.stiffness_n_mm[np.ix_(rows, rows)]
    squares, shapes = np.linalg.eigh(stiffness)
    is_bent = squares > RIGID * squares[-1]
    twice_energy = float(np.einsum("ik,ij,jk->", driven[own], stiffness, driven[own]))
    found = np.zeros((driven.shape[0], int(is_bent.sum())))
    found[own] = OTHER_LOADS * shapes[:, is_bent] * np.sqrt(twice_energy / squares[is_bent])
    return found


@dataclass(frozen=True, slots=True, eq=False)
class BodyOutline:
    """A body and the straight stretches of its outline, in millimetres.

    Parameters
    ----------
    body : LinkBody
        The body in the drawing.
    starts_mm, ends_mm : ndarray of float, shape (2, k)
        Ends of the stretches, with the body on their left.
    bending : Bending or None
        How it bends; None where that is not known.
    """

    body: LinkBody
    starts_mm: Array
    ends_mm: Array
    bending: Bending | None = None

    def chunks(self, place: Placement) -> Chunks:
        """Divide the straight stretches into chunks, in pixels of the undistorted plane."""
        starts, ends = place.to_flat_px(self.starts_mm), place.to_flat_px(self.ends_mm)
        length = np.hypot(*(ends - starts))
        middles, normals = [], []
        for k in range(length.size):
            free = length[k] - 2.0 * FROM_CORNERS_PX
            count = int(free // CHUNK_PX)
            if count < 1:
                continue
            way = (ends[:, k] - starts[:, k]) / length[k]
            # In the drawing, the body is to the left of its outline, so that the outward normal points to the right.
            out = place.turn_sign * np.array([way[1], -way[0]])
            for at in FROM_CORNERS_PX + free * (np.arange(count) + 0.5) / count:
                middles.append(starts[:, k] + at * way)
                normals.append(out)
        found = Chunks(np.reshape(middles, (-1, 2)).T, np.reshape(normals, (-1, 2)).T, 0.5 * CHUNK_PX)
        return found if self.bending is None else self.bending.of(self.body, found, place)

    def about_px(self, place: Placement) -> Array:
        """Reference point of the body, in pixels of the undistorted plane."""
        return np.asarray(place.to_flat_px(self.body.centroid_mm[:, None])[:, 0])


def outlines_of(mechanism: Mechanism) -> tuple[BodyOutline, ...]:
    """Select the straight edges of every body of the drawing, without the cuts through flexures."""
    region, bending = mechanism.region, bending_of(mechanism)
    beside = BESIDE * region.size_mm
    found = []
    for body in bodies_of(mechanism):
        starts, ends = [], []
        for loop in (body.outline, *body.holes):
            for curve in loop.curves:
                if not curve.is_straight:
                    continue
                a, b = curve.start_mm, curve.end_mm
                way = (b - a) / np.hypot(*(b - a))
                outside = 0.5 * (a + b) + beside * np.array([way[1], -way[0]])
                if not region.holds(outside[:, None])[0]:
                    starts.append(a)
                    ends.append(b)
        found.append(BodyOutline(body, np.reshape(starts, (-1, 2)).T, np.reshape(ends, (-1, 2)).T, bending))
    return tuple(found)


def silhouette(mechanism: Mechanism, place: Placement, width_px: int, height_px: int, step_px: int) -> Array:
    """Mask (0 or 1) of the drawing in the picture, one value every `step_px`; shape (height / step, width / step)."""
    x, y = np.meshgrid(np.arange(0, width_px, step_px), np.arange(0, height_px, step_px))
    points = place.to_mm(np.stack([x.ravel(), y.ravel()]).astype(float))
    return np.asarray(mechanism.region.holds(points).reshape(x.shape), dtype=np.float64)


def in_sight(chunks: Sequence[Chunks], width_px: int, height_px: int, flat: FlatMap | None = None) -> list[float]:
    """Fraction of each body's outline pieces that lie in the picture."""
    shares = []
    for each in chunks:
        x, y = each.middles if flat is None else flat.to_picture(each.middles)
        inside = (x > REACH_PX) & (x < width_px - REACH_PX) & (y > REACH_PX) & (y < height_px - REACH_PX)
        shares.append(float(inside.mean()) if inside.size else 0.0)
    return shares
