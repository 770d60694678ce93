"""Rigid motion of one body in a picture, from all visible stretches of its outline.

The motion is fitted by weighted least squares to the offsets of all chunks of the outline (`outline_chunks`); Tukey's
weights suppress chunks whose edge is covered. Scatter of the chunks beyond their own noise increases the covariance.
Edge bias, size error, and the offset of every side that may have a shadow (see below) are fitted together with
the motion, each with its standard uncertainty as prior.

Find sides of a body whose edges are blurred differently from its other sides, because of a shadow or glare.

A narrow shadow along an edge is a second step in the same profile. A shadow with a fraction q of the contrast and a
width w beyond the edge displaces the single fitted step by q w, and adds q (1 - q) w^2 to the squared blur of the step
(mean and variance of a mixture of two steps). Optics and defocus blur all sides equally; motion blurs opposite sides
equally, and displaces neither of them. If one side's squared blur differs by D from the blur that optics and motion
explain, its edges may be displaced by sqrt(|D| q / (1 - q)): by sqrt(|D|) if the shadow is half as dark as the body (q
= 1/2), by twice that for q = 4/5. The offset of a side with the excess D therefore has the standard uncertainty
sqrt(|D|).

A lens with distortion, or a camera that looks at the plane at an angle, magnifies the sides differently. The blur of
the optics is equal on all sides in the picture; the blur of an object out of focus is more nearly equal in the object
plane. The blurs of two sides are therefore accepted as equal if they are equal in the picture, in the object plane, or
in between.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.outline_chunks import BLURS_PX, PLAIN, ChunkEdges, Chunks, EdgeView, FlatMap, chunk_edges

Array = NDArray[np.float64]

SAME_LINE_PX = 0.5
"""Distance from a line within which chunks belong to one straight stretch; the rounding of a pose causes far less."""
OPPOSITE = -0.94
"""Cosine between the normals of two sides below which they count as opposite: at most 20 degrees from antiparallel, so
that motion blurs both equally within a tenth. Other sides that are not parallel count as crossing each other.
"""
SURE = 3.0
"""Difference in standard uncertainties above which a side counts as doubtful. One side in four hundred exceeds it by
chance, and then only has a larger uncertainty in that picture; for a side of one chunk (noise 4 for a contrast of 150,
blur 1.6 px) a shadow of 1 px and a fifth of the contrast is detected."""
OPTICS = 0.05
"""Share of the squared blur by which optics and defocus may let the sides of one body differ; this is a fortieth of the
blur itself."""


def sides_of(middles: Array, normals: Array) -> NDArray[np.intp]:
    """Index of the straight stretch to which each chunk belongs, shape (m,); chunks are in order along the outline.

    Parameters
    ----------
    middles, normals : ndarray of float, shape (2, m)
        Middles and unit normals of the chunks, in pixels.
    """
    side = np.zeros(middles.shape[1], dtype=np.intp)
    for k in range(1, side.size):
        off = abs(float((middles[:, k] - middles[:, k - 1]) @ normals[:, k]))
        is_on = off < SAME_LINE_PX and float(normals[:, k] @ normals[:, k - 1]) > 1.0 - 1e-6
        side[k] = side[k - 1] + (not is_on)
    return side


def doubtful_offsets(
    middles: Array, normals: Array, blur_px: Array, u_blur_px: Array, stretch: Array | None = None
) -> Array:
    """Uncertainty of the edge positions that is suggested by differences in blur between the sides of a body.

    Each column of the result is one standard uncertainty, which all chunks of one side share.

    Parameters
    ----------
    middles, normals : ndarray of float, shape (2, m)
        Middles and unit normals of the fitted chunks, in their order along the outline.
    blur_px, u_blur_px : ndarray of float, shape (m,)
        Gaussian sigma of each chunk's edge, and its standard uncertainty.
    stretch : ndarray of float, shape (m,), or None
        Distance across each edge in the undistorted plane over that in the picture; None for 1 everywhere.

    Returns
    -------
    ndarray of float, shape (m, k)
        For each of k doubtful sides a column with the standard uncertainty of its chunks' positions (px), and 0 for all
        other chunks.
    """
    side = sides_of(middles, normals)
    numbers = np.unique(side)
    square, variance = blur_px**2, np.maximum((2.0 * blur_px * u_blur_px) ** 2, 1e-12)
    mean, spread, normal = np.zeros(numbers.size), np.zeros(numbers.size), np.zeros((2, numbers.size))
    magnified = np.ones(numbers.size)
    for j, number in enumerate(numbers):
        own = side == number
        weight = 1.0 / variance[own]
        mean[j] = weight @ square[own] / weight.sum()
        chi_square = float(weight @ (square[own] - mean[j]) ** 2)
        spread[j] = max(1.0, chi_square / max(int(own.sum()) - 1, 1)) / weight.sum()
        normal[:, j] = normals[:, own].mean(axis=1)
        if stretch is not None:
            magnified[j] = stretch[own].mean()
    excess = _excess(mean, spread, normal, magnified)
    if not excess.any():
        return np.zeros((side.size, 0))
    # If one side has a shadow, the positions of the other sides have an uncertainty as well, from the uncertainty of
    # their blur.
    u_side = np.sqrt(np.where(excess > 0.0, excess, np.sqrt(spread)))
    return np.asarray(np.where(side[:, None] == numbers, u_side, 0.0))


def _excess(mean: Array, variance: Array, normal: Array, magnified: Array) -> Array:
    """Part of each side's squared blur that only a shadow explains, shape (k,); 0 for a side without shadow.

    Parameters
    ----------
    mean, variance : ndarray of float, shape (k,)
        Mean squared blur of each side, and the variance of this mean.
    normal : ndarray of float, shape (2, k)
        Outward normal of each side.
    magnified : ndarray of float, shape (k,)
        Mean stretch of each side.
    """
    cosine = normal.T @ normal
    apart = mean[:, None] - mean
    least = np.minimum(mean[:, None], mean)
    limit = np.hypot(SURE * np.sqrt(variance[:, None] + variance), OPTICS * least)
    limit += least * np.abs(np.exp(2.0 * np.abs(np.log(magnified[:, None] / magnified))) - 1.0)
    agree = np.abs(apart) <= limit
    across = np.abs(cosine) < -OPPOSITE
    found = np.zeros(mean.size)
    for j in range(mean.size):
        facing = cosine[j] < OPPOSITE
        if facing.any():
            # Motion blurs opposite sides equally, and equal shadows on opposite sides do not move the body.
            if agree[j, facing].any():
                continue
            is_usual, are_usual = (bool(agree[k][:, across[j]].any()) for k in ([j], np.flatnonzero(facing)))
            if not is_usual or are_usual:
                found[j] = np.abs(apart[j, facing]).min()
        elif across[j].any():
            # A side without an opposite side may be blurred by motion, which cannot be distinguished from a shadow.
            sharpest = int(np.flatnonzero(across[j])[np.argmin(mean[across[j]])])
            found[j] = apart[j, sharpest] if apart[j, sharpest] > limit[j, sharpest] else 0.0
    return found


STEPS = 5
SETTLED_PX = 0.01
TUKEY = 4.685
"""Tuning constant of Tukey's biweight: 95 % efficient for normal errors (Huber (1981), Robust Statistics, DOI
10.1002/0471725250)."""
SINGULAR = 1e8
"""Condition number above which the edges do not determine the motion: half the digits of a double are lost."""
FEWEST = 6
"""Least number of chunks: twice the unknowns of a rigid motion, so that the scatter can be estimated too."""
LEAST_SHARE = 0.4
"""Least share of the chunks in view whose edge must be found; with fewer, the body is covered by something."""
LEAST_IN_VIEW = 0.4
BENDING_ERROR = 0.05
"""Relative error of how far a chunk moves as its body bends: wrong by a tenth beside the root of a flexure, where the
model assumes the stress of a beam, and hardly at all farther away."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidFit:
    """A rigid motion measured in a picture.

    Parameters
    ----------
    shift_px : ndarray of float, shape (2,)
        Motion of the reference point.
    angle_rad : float
        Rotation, from x towards y of the picture.
    covariance : ndarray of float, shape (3, 3)
        Covariance of x and y in px and of the angle in rad.
    seen, in_view, all : int
        Number of chunks that were fitted, of chunks that lie in the picture, and of all chunks.
    blur_px : float
        Standard deviation of the edges' blur.
    by_outward, by_scale : ndarray of float, shape (3,)
        Change of x, y and the angle per 1 px of outward shift of all edges, and per unit of relative error of the
        body's size. These errors are the same in all frames and not included in the covariance.
    by_shadows : ndarray of float, shape (3, 3)
        Covariance of x, y and the angle due to possible shadows along some sides; the same in all frames.
    size_error, u_size_error : float
        Relative excess of the body's size in the picture over the drawing, after a common shift of all edges was
        fitted; and its standard uncertainty, infinite if the edges do not determine it.
    """

    shift_px: Array
    angle_rad: float
    covariance: Array
    seen: int
    in_view: int
    all: int
    blur_px: float
    by_outward: Array
    by_scale: Array
    by_shadows: Array
    size_error: float = 0.0
    u_size_error: float = float("inf")


def fit_rigid(
    grey: NDArray[np.float64],
    chunks: Chunks,
    about: Array,
    body_is_dark: bool,
    start: tuple[Array, float],
    view: EdgeView = PLAIN,
) -> RigidFit | None:
    """Fit a body's motion from a close initial estimate; None if too little of its outline is visible.

    Parameters
    ----------
    grey : ndarray of float, shape (height, width)
        Levels proportional to light.
    chunks : Chunks
        Chunks of the body at its drawn position, in pixels.
    about : ndarray of float, shape (2,)
        Drawn position of the reference point, in pixels.
    body_is_dark : bool
        Whether the body is darker than the background.
    start : (ndarray of float, float)
        Initial estimate: shift in pixels and angle in rad; the edges must lie within about 3 px of it.
    view : EdgeView
        How edges appear in this picture.
    """
    shift, angle = np.array(start[0], dtype=float), float(start[1])
    blur, found = 1.2, None
    for _ in range(STEPS):
        now = chunks.moved(shift, angle, about)
        edges = chunk_edges(grey, now, body_is_dark, blur, view)
        if edges.used.sum() < max(FEWEST, LEAST_SHARE * edges.in_view.sum()):
            return None
        blur = float(np.clip(np.median(edges.blur[edges.used]), *BLURS_PX))
        step = _rigid(now, edges, about + shift, view)
        if step is None:
            return None
        move, covariance, shared, by_shadows, size = step
        shift, angle = shift + move[:2], angle + float(move[2])
        found = RigidFit(shift, angle, covariance, int(edges.used.sum()), int(edges.in_view.sum()),
                         edges.used.size, blur, shared[:, 0], shared[:, 1], by_shadows, *size)  # fmt: skip
        reach = float(np.abs(chunks.middles - about[:, None]).max())
        if float(np.hypot(*move[:2])) + abs(float(move[2])) * reach < SETTLED_PX:
            break
    return found


def capture_rigid(
    grey: NDArray[np.float64],
    pyramid: Sequence[NDArray[np.float64]],
    chunks: Chunks,
    about: Array,
    body_is_dark: bool,
    start: tuple[Array, float],
    view: EdgeView = PLAIN,
) -> RigidFit | None:
    """Fit a body's motion from a more distant initial estimate: in successively halved pictures, the coarsest first.

    Parameters
    ----------
    grey : ndarray of float, shape (height, width)
        The picture.
    pyramid : sequence of ndarray of float
        The picture halved once, twice and so on (from `halved`).
    chunks, about, body_is_dark, start, view
        As for `fit_rigid`.
    """
    shift, angle = start
    for level in range(len(pyramid), 0, -1):
        scale = 0.5**level
        # The centre of a pixel of the halved picture lies between the centres of two original pixels.
        offset = 0.5 * scale - 0.5
        small = Chunks(
            chunks.middles * scale + offset, chunks.normals, max(chunks.half_length * scale, 2.0), chunks.bends * scale
        )
        coarse = replace(view, flat=None if view.flat is None else _Halved(view.flat, scale, offset), outward_px=0.0)
        begin = (shift * scale, angle)
        rough = fit_rigid(pyramid[level - 1], small, about * scale + offset, body_is_dark, begin, coarse)
        if rough is not None:
            shift, angle = rough.shift_px / scale, rough.angle_rad
    return fit_rigid(grey, chunks, about, body_is_dark, (shift, angle), view)


def halved(grey: NDArray[np.float64], times: int) -> list[NDArray[np.float64]]:
    """Halve a picture `times` times, averaging four pixels into one."""
    out = []
    for _ in range(times):
        height, width = (size // 2 * 2 for size in grey.shape)
        cut = grey[:height, :width]
        grey = 0.25 * (cut[::2, ::2] + cut[1::2, ::2] + cut[::2, 1::2] + cut[1::2, 1::2])
        out.append(grey)
    return out


@dataclass(frozen=True, slots=True)
class _Halved:
    """The map to the undistorted plane for a halved picture."""

    whole: FlatMap
    scale: float
    offset: float

    def to_flat(self, points: Array) -> Array:
        return self.whole.to_flat((points - self.offset) / self.scale) * self.scale + self.offset

    def to_picture(self, points: Array) -> Array:
        return self.whole.to_picture((points - self.offset) / self.scale) * self.scale + self.offset


def _rigid(
    chunks: Chunks, edges: ChunkEdges, about: Array, view: EdgeView
) -> tuple[Array, Array, Array, Array, tuple[float, float]] | None:
    """Small rigid motion from the chunks' offsets, with its covariance, effects of shared errors, and the size error.

    Return the motion; its covariance; the sensitivities of the three pose parameters to a common edge shift and to a
    relative size error, shape (3, 2); the covariance due to possible shadows at the edges, shape (3, 3); and the size
    error with its standard uncertainty. Return None if the offsets do not determine the motion.
    """
    used = edges.used
    arm = chunks.middles[:, used] - about[:, None]
    nx, ny = chunks.normals[:, used]
    rigid = np.stack([nx, ny, -nx * arm[1] + ny * arm[0]], axis=1)
    doubtful = doubtful_offsets(
        chunks.middles[:, used], chunks.normals[:, used], edges.blur[used], edges.u_blur[used], edges.stretch[used]
    )
    # An edge seen farther out is one offset of all chunks; a body that is larger than drawn moves each by its distance;
    # a doubtful side has an offset of its own. Of each of these it is known how large it may be, and so it is of how a
    # body bends, in each frame anew.
    shared = np.stack([np.ones_like(nx), nx * arm[0] + ny * arm[1]], axis=1)
    bends = chunks.bends[used] if chunks.bends.size else np.zeros((nx.size, 0))
    columns = np.hstack([rigid, shared * (view.u_outward_px, view.u_size), doubtful, bends])
    prior = np.diag([0.0] * 3 + [1.0] * (columns.shape[1] - 3))
    offset = edges.offset[used]
    weight = np.ones(offset.size)
    move = np.zeros(columns.shape[1])
    scatter = 1.0
    for _ in range(12):
        sd = np.hypot(np.sqrt(edges.variance[used]), BENDING_ERROR * (bends @ move[move.size - bends.shape[1] :]))
        w = weight / sd**2
        held = rigid.T @ (w[:, None] * rigid)
        size_of = np.sqrt(np.diag(held))
        if size_of.min() <= 0.0 or np.linalg.cond(held / np.outer(size_of, size_of)) > SINGULAR:
            return None
        normal = columns.T @ (w[:, None] * columns) + prior
        move = np.linalg.solve(normal, columns.T @ (w * offset))
        rest = (offset - columns @ move) / sd
        scatter = max(1.0, 1.4826 * float(np.median(np.abs(rest))))
        weight = np.clip(1.0 - (rest / (TUKEY * scatter)) ** 2, 0.0, None) ** 2
        if weight.sum() < FEWEST:
            return None
    kept = weight > 0.0
    if kept.sum() < max(FEWEST, LEAST_SHARE * edges.in_view.sum()):
        return None
    # The part of the offsets that these errors explain does not count as noise; their normalised squares are added
    # instead.
    left_over = float(np.sum(weight * rest**2)) + float(move[3:] @ move[3:])
    spread = max(1.0, left_over / max(float(weight.sum()) - 3.0, 1.0))
    inverse = np.linalg.inv(normal)
    size = _size_error(np.hstack([rigid, shared]), offset, sd)
    noise = inverse[:3] @ (normal - prior) @ inverse[:, :3]
    bent = columns.shape[1] - bends.shape[1]
    by_shadows = inverse[:3, 5:bent] @ inverse[5:bent, :3]
    by_bends = inverse[:3, bent:] @ inverse[bent:, :3]
    by_shared = inverse[:3] @ (columns.T @ (w[:, None] * shared))
    return move[:3], spread * noise + by_bends, by_shared, by_shadows, size


def _size_error(columns: Array, offset: Array, sd: Array) -> tuple[float, float]:
    """Relative error of the body's size and its standard uncertainty, fitted together with motion and edge offset."""
    whitened, wanted = columns / sd[:, None], offset / sd
    scale = np.linalg.norm(whitened, axis=0)
    if offset.size < FEWEST + columns.shape[1] or scale.min() <= 0.0:
        return 0.0, float("inf")
    whitened = whitened / scale
    normal = whitened.T @ whitened
    if np.linalg.cond(normal) > SINGULAR:
        return 0.0, float("inf")
    inverse = np.linalg.inv(normal)
    found = inverse @ (whitened.T @ wanted)
    spread = max(1.0, float(np.sum((wanted - whitened @ found) ** 2)) / (offset.size - columns.shape[1]))
    return float(found[-1] / scale[-1]), float(np.sqrt(spread * inverse[-1, -1]) / scale[-1])
