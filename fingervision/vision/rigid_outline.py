"""Rigid motion of one body in a picture, from all visible stretches of its outline.

The straight stretches of an outline are divided into chunks about a millimetre long. In each chunk one blurred step is
fitted to all pixels near the edge, I = a + b Phi(-(s - d) / sigma_e), with s the pixel's distance along the outward
normal. Nothing is resampled, so that the sub-pixel phase causes no bias. Weighted least squares over the chunks'
offsets d then gives one rigid motion; Tukey's weights suppress chunks whose edge is covered. Scatter of the chunks
beyond their own noise widens the covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Array = NDArray[np.float64]

REACH_PX = 6.0
"""Pixels on either side of an edge: three blurs of 1.5 px, and room for the search."""
LEAST_CONTRAST = 5.0
"""Standard deviations of a pixel's noise below which a step is no edge."""
FARTHEST_PX = 3.5
"""How far from where it is expected an edge may be found: beyond, the window does not hold it."""
STEPS = 5
SETTLED_PX = 0.01
BLURS_PX = (0.4, 3.5)
TUKEY = 4.685
"""Of Tukey's biweight: 95 % efficient for normal errors (Huber (1981), Robust Statistics, DOI 10.1002/0471725250)."""
SINGULAR = 1e8
"""Condition beyond which edges leave a motion free: half the digits of a double."""
FEWEST = 6
"""Chunks: twice the unknowns of a rigid motion, so that their scatter is known too."""
LEAST_SHARE = 0.4
"""Of the chunks in view that must be seen: less is a body that something covers."""
LEAST_IN_VIEW = 0.4
OTHER_LEVEL, OTHER_CONTRAST, OTHER_BLUR, OTHER_BLUR_PX, OTHER_NOISE = 0.3, (0.4, 2.5), 1.25, 0.2, 4.0
"""What a chunk may differ in from its body's others: level of the body in contrasts, contrast (medians), blur (a factor
and pixels), noise (a factor; quartiles). Beyond, its edge is that of a shadow, or two edges are fitted as one: a cast
shadow's edge has another level inside, and one of 3 px twice the blur. Texture of a sixth of the contrast stays."""
LEAST_WINDOW = 0.7
"""Of a chunk's window that must lie in the picture: an edge in its middle then has ground and body on its sides."""


@dataclass(frozen=True, slots=True, eq=False)
class Chunks:
    """Stretches of a body's outline.

    Parameters
    ----------
    middles : ndarray of float, shape (2, m)
        Their middles.
    normals : ndarray of float, shape (2, m)
        Unit vectors out of the body.
    half_length : float
        Half their length.
    """

    middles: Array
    normals: Array
    half_length: float

    def moved(self, shift: Array, angle: float, about: Array) -> "Chunks":
        """Move the chunks rigidly: turned about a point, then shifted."""
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        middles = turn @ (self.middles - about[:, None]) + (about + shift)[:, None]
        return replace(self, middles=middles, normals=turn @ self.normals)


class FlatMap(Protocol):
    """Map from the picture to the object plane without perspective and distortion, in pixels, and back."""

    def to_flat(self, points: Array) -> Array:
        """Remove lens distortion and perspective from points, shape (2, n)."""
        ...

    def to_picture(self, points: Array) -> Array:
        """Apply lens distortion and perspective to points, shape (2, n)."""
        ...


@dataclass(frozen=True, slots=True)
class EdgeView:
    """How the edges of bodies appear in a picture.

    Parameters
    ----------
    flat : FlatMap or None
        Lens and perspective; chunks and motions are then those of the flat plane. None where the picture is flat.
    outward_px : float
        How far outside of its body an edge is seen (edge bias), in pixels of the picture.
    shared_pixels : float
        So many pixels count as one: a codec shares its errors among them.
    body_level, contrast : float or None
        Level of the bodies, and how much lighter or darker the ground is; None where they are not known.
    """

    flat: FlatMap | None = None
    outward_px: float = 0.0
    shared_pixels: float = 1.0
    body_level: float | None = None
    contrast: float = 0.0


PLAIN = EdgeView()
_GAUSS = np.array([-(0.6**0.5), 0.0, 0.6**0.5])
_GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
"""Gauss and Legendre's three points: the mean over a chunk of a curve of fifth order."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidFit:
    """A rigid motion measured in a picture.

    Parameters
    ----------
    shift_px : ndarray of float, shape (2,)
        Motion of the reference point.
    angle_rad : float
        Rotation, from x to y of the picture.
    covariance : ndarray of float, shape (3, 3)
        Of x and y in px and the angle in rad.
    seen, in_view, all : int
        Chunks that were fitted, that lie in the picture, and that there are.
    blur_px : float
        Standard deviation of the edges' blur.
    by_outward, by_scale : ndarray of float, shape (3,)
        What x, y and the angle are off where every edge is seen 1 px farther out, and where the body is larger than
        drawn by its own size: errors that all frames share, which the covariance does not hold.
    size_error, u_size_error : float
        How much larger the body is seen than drawn, relative, whatever widens or narrows all of its edges alike taken
        off; and its standard uncertainty, infinite where its edges do not tell.
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
    size_error: float = 0.0
    u_size_error: float = float("inf")


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    offset: Array
    variance: Array
    blur: Array
    used: NDArray[np.bool_]
    in_view: NDArray[np.bool_]


def fit_rigid(
    grey: NDArray[np.float64],
    chunks: Chunks,
    about: Array,
    body_is_dark: bool,
    start: tuple[Array, float],
    view: EdgeView = PLAIN,
) -> RigidFit | None:
    """Fit a body's motion from a near starting value; None where too little of its outline is visible.

    Parameters
    ----------
    grey : ndarray of float, shape (height, width)
        Levels proportional to light.
    chunks : Chunks
        Of the body where it is drawn, in pixels.
    about : ndarray of float, shape (2,)
        Reference point where it is drawn, in pixels.
    body_is_dark : bool
        Whether the body is darker than its ground.
    start : (ndarray of float, float)
        Shift in pixels and angle in rad from which to look; the edges lie within some 3 px of there.
    view : EdgeView
        How edges show in this picture.
    """
    shift, angle = np.array(start[0], dtype=float), float(start[1])
    blur, found = 1.2, None
    for _ in range(STEPS):
        now = chunks.moved(shift, angle, about)
        edges = _edges(grey, now, body_is_dark, blur, view)
        if edges.used.sum() < max(FEWEST, LEAST_SHARE * edges.in_view.sum()):
            return None
        blur = float(np.clip(np.median(edges.blur[edges.used]), *BLURS_PX))
        step = _rigid(now, edges, about + shift)
        if step is None:
            return None
        move, covariance, shared, size = step
        shift, angle = shift + move[:2], angle + float(move[2])
        found = RigidFit(shift, angle, covariance, int(edges.used.sum()), int(edges.in_view.sum()),
                         edges.used.size, blur, shared[:, 0], shared[:, 1], *size)  # fmt: skip
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
    """Fit from a farther starting value: in successively halved pictures, the coarsest first.

    Parameters
    ----------
    grey : ndarray of float, shape (height, width)
        The picture.
    pyramid : sequence of ndarray of float
        It halved once, twice and so on (`halved`).
    chunks, about, body_is_dark, start, view
        As `fit_rigid`.
    """
    shift, angle = start
    for level in range(len(pyramid), 0, -1):
        scale = 0.5**level
        # The middle of a pixel of the halved picture lies between those of two.
        offset = 0.5 * scale - 0.5
        small = Chunks(chunks.middles * scale + offset, chunks.normals, max(chunks.half_length * scale, 2.0))
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
    """The map for a picture that was halved."""

    whole: FlatMap
    scale: float
    offset: float

    def to_flat(self, points: Array) -> Array:
        return self.whole.to_flat((points - self.offset) / self.scale) * self.scale + self.offset

    def to_picture(self, points: Array) -> Array:
        return self.whole.to_picture((points - self.offset) / self.scale) * self.scale + self.offset


@dataclass(frozen=True, slots=True, eq=False)
class _InPicture:
    """Chunks in picture coordinates, and how much longer a distance across them is in the flat plane."""

    middles: Array
    normals: Array
    half_lengths: Array
    stretch: Array


def _in_picture(chunks: Chunks, flat: FlatMap | None) -> _InPicture:
    """Map chunks into the picture by their mean position and their chord."""
    count, half = chunks.middles.shape[1], chunks.half_length
    if flat is None or not count:
        return _InPicture(chunks.middles, chunks.normals, np.full(count, half), np.ones(count))
    way = np.stack([-chunks.normals[1], chunks.normals[0]])
    at = [chunks.middles + t * half * way for t in (*_GAUSS, -1.0, 1.0)]
    seen = flat.to_picture(np.concatenate([*at, chunks.middles + chunks.normals], axis=1)).reshape(2, 6, count)
    middles = np.tensordot(seen[:, :3], _GAUSS_WEIGHTS, axes=(1, 0))
    chord = seen[:, 4] - seen[:, 3]
    length = np.hypot(*chord)
    normals = np.stack([chord[1], -chord[0]]) / length
    normals *= np.sign(np.sum(normals * (seen[:, 5] - seen[:, 1]), axis=0))
    out = flat.to_flat(np.concatenate([middles + normals, middles - normals], axis=1)).reshape(2, 2, count)
    stretch = 0.5 * np.sum((out[:, 0] - out[:, 1]) * chunks.normals, axis=0)
    return _InPicture(middles, normals, 0.5 * length, stretch)


def _edges(grey: NDArray[np.float64], flat_chunks: Chunks, body_is_dark: bool, blur: float, view: EdgeView) -> _Edges:
    """Fit a blurred step to the pixels about every chunk; offsets are in the flat plane."""
    chunks = _in_picture(flat_chunks, view.flat)
    count = chunks.middles.shape[1]
    height, width = grey.shape
    reach = REACH_PX
    longest = float(chunks.half_lengths.max(initial=0.0))
    box = ceil(np.hypot(longest, reach)) + 1
    offset, variance, blurs = np.zeros(count), np.full(count, np.inf), np.full(count, blur)
    level, contrast, noise = np.zeros(count), np.ones(count), np.ones(count)
    used, in_view = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    steps = np.arange(-box, box + 1)
    for k in range(count):
        x, y = chunks.middles[:, k]
        column, row = round(float(x)), round(float(y))
        columns = steps[(steps >= -column) & (steps < width - column)]
        rows = steps[(steps >= -row) & (steps < height - row)]
        if not (0 <= column < width and 0 <= row < height):
            continue
        nx, ny = chunks.normals[:, k]
        half = chunks.half_lengths[k]
        dx, dy = columns[None, :] + column - x, rows[:, None] + row - y
        s, t = dx * nx + dy * ny, -dx * ny + dy * nx
        inside = (np.abs(t) <= half) & (np.abs(s) <= reach)
        if inside.sum() < LEAST_WINDOW * 4.0 * half * reach:
            continue
        in_view[k] = True
        window = grey[row + rows[0] : row + rows[-1] + 1, column + columns[0] : column + columns[-1] + 1]
        values = window[inside]
        fitted = _step(values, s[inside], blur, body_is_dark)
        if fitted is not None:
            offset[k], variance[k], blurs[k], level[k], contrast[k], noise[k] = fitted
            used[k] = True
    if view.body_level is not None:
        used &= np.abs(level - view.body_level) <= OTHER_LEVEL * abs(view.contrast)
    if used.any():
        used &= _like_the_others(blurs, level, contrast, noise, used)
    offset = chunks.stretch * (offset - view.outward_px)
    return _Edges(offset, variance * view.shared_pixels * chunks.stretch**2, blurs, used, in_view)


def _like_the_others(
    blurs: Array, level: Array, contrast: Array, noise: Array, used: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether a chunk shows the body's own edge, compared with the median of all chunks that show an edge."""
    usual = float(np.median(contrast[used]))
    # A shadow falls on up to half of a body's sides: the better half tells what an edge of its own looks like.
    sharp, quiet = float(np.quantile(blurs[used], 0.25)), float(np.quantile(noise[used], 0.25))
    low, high = OTHER_CONTRAST
    return np.asarray(
        (np.abs(level - np.median(level[used])) <= OTHER_LEVEL * abs(usual))
        & (contrast / usual >= low)
        & (contrast / usual <= high)
        & (blurs <= OTHER_BLUR * sharp + OTHER_BLUR_PX)
        & (noise <= OTHER_NOISE * quiet)
    )


def _step(
    values: Array, s: Array, blur: float, body_is_dark: bool
) -> tuple[float, float, float, float, float, float] | None:
    """Fit a blurred step by Gauss-Newton iteration; None where there is no step.

    Returned are offset, its variance, blur, level of the body, its difference from the background, and standard
    deviation of the noise.

    Pixels are squares: their own width adds 1/12 to the square of the blur (measuring.md).
    """
    d, sigma = 0.0, float(np.hypot(blur, 12**-0.5))
    for _ in range(4):
        z = (s - d) / sigma
        step, bell = ndtr(-z), np.exp(-0.5 * z**2) / (sigma * np.sqrt(2.0 * np.pi))
        columns = np.stack([np.ones_like(s), step, bell, bell * z], axis=1)
        normal = columns.T @ columns
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        a, b, by_d, by_sigma = inverse @ (columns.T @ values)
        rest = values - columns @ np.array([a, b, by_d, by_sigma])
        noise2 = float(rest @ rest) / max(values.size - 4, 1)
        if b == 0.0 or (b < 0.0) != body_is_dark or abs(b) < LEAST_CONTRAST * np.sqrt(noise2):
            return None
        move = float(by_d / b)
        d = float(np.clip(d + np.clip(move, -2.0, 2.0), -FARTHEST_PX - 1.0, FARTHEST_PX + 1.0))
        wider = float(by_sigma / b)
        sigma = float(np.clip(sigma + np.clip(wider, -0.3 * sigma, 0.3 * sigma), *BLURS_PX))
        if abs(move) < 1e-3:
            break
    if abs(d) > FARTHEST_PX:
        return None
    variance = noise2 * float(inverse[2, 2]) / float(b) ** 2
    of_optics = float(np.sqrt(max(sigma**2 - 1.0 / 12.0, BLURS_PX[0] ** 2)))
    return d, variance, of_optics, float(a + b), float(b), float(np.sqrt(noise2))


def _rigid(chunks: Chunks, edges: _Edges, about: Array) -> tuple[Array, Array, Array, tuple[float, float]] | None:
    """Small rigid motion from the chunks' offsets, its covariance, the effect of shared errors, and the size's error.

    None where the offsets do not determine the motion.
    """
    used = edges.used
    arm = chunks.middles[:, used] - about[:, None]
    nx, ny = chunks.normals[:, used]
    columns = np.stack([nx, ny, -nx * arm[1] + ny * arm[0]], axis=1)
    offset, sd = edges.offset[used], np.sqrt(edges.variance[used])
    weight = np.ones(offset.size)
    move = np.zeros(3)
    scatter = 1.0
    for _ in range(12):
        w = weight / sd**2
        normal = columns.T @ (w[:, None] * columns)
        if (
            np.diag(normal).min() <= 0.0
            or np.linalg.cond(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)))) > 1e8
        ):
            return None
        move = np.linalg.solve(normal, columns.T @ (w * offset))
        rest = (offset - columns @ move) / sd
        scatter = max(1.0, 1.4826 * float(np.median(np.abs(rest))))
        weight = np.clip(1.0 - (rest / (TUKEY * scatter)) ** 2, 0.0, None) ** 2
        if weight.sum() < FEWEST:
            return None
    kept = weight > 0.0
    if kept.sum() < max(FEWEST, LEAST_SHARE * edges.in_view.sum()):
        return None
    degrees = float(weight.sum()) - 3.0
    spread = max(1.0, float(np.sum(weight * rest**2)) / max(degrees, 1.0))
    # An edge seen farther out is one offset of all chunks; a body that is larger than drawn moves each by its distance.
    shared = np.stack([np.ones_like(nx), nx * arm[0] + ny * arm[1]], axis=1)
    inverse = np.linalg.inv(normal)
    size = _size_error(np.hstack([columns, shared]), offset, sd)
    return move, spread * inverse, inverse @ (columns.T @ (w[:, None] * shared)), size


def _size_error(columns: Array, offset: Array, sd: Array) -> tuple[float, float]:
    """Relative error of the body's size, and its standard uncertainty, fitted beside motion and edge offset."""
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
