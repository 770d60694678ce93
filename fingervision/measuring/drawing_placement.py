"""Place a drawing on a picture: by its silhouette, or by two or three points given in picture and drawing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError, UsageError
from fingervision.measuring.body_outlines import BodyOutline, Placement, in_sight, silhouette
from fingervision.models.mechanism import Mechanism
from fingervision.vision.outline_chunks import PLAIN, Chunks, EdgeView, FlatMap
from fingervision.vision.rigid_outline import RigidFit, capture_rigid, halved

Array = NDArray[np.float64]

TURNS = 36
"""Number of directions that are tried, 10 degrees apart; a thin bar still overlaps the same bar rotated by half of this
step.
"""
GRID = 160
"""Grid points along the picture's longer side for the comparison of silhouettes."""
SKIPPED = 2
"""Only every second grid point is used for the first estimate of the direction."""
LEAST_OVERLAP = 0.7
"""Least overlap (intersection over union) of the areas of picture and drawing; below it the picture shows something
else."""
AS_GOOD = 0.03
"""Difference of overlap within which two placements count as equally good; blur or a moved finger cause such a
difference.
"""
ALIKE = 0.9
"""Overlap of two placements above which they count as the same silhouette, as for a symmetric drawing; bars of 50 px
that are shifted by half a grid step have this overlap.
"""
APART_RAD = 0.35
LEVELS = 4
"""Number of times that the picture is halved for the first fit, which then finds edges up to 50 px away."""
LEAST_LAID = 0.6
"""Least share of the chunks in view that must be found for a placement: with less, the bodies are covered, or edges of
a shadow are mistaken for theirs, and all poses would refer to a wrong placement.
"""
OTHER_SCALE = 0.1
"""Largest relative difference between the scale of given points and the stated scale: points are given to a few pixels
in some hundred."""


@dataclass(frozen=True, slots=True)
class GivenPoint:
    """A point whose position is known in the picture and in the drawing.

    Parameters
    ----------
    x_px, y_px : float
        Position in the picture.
    x_mm, y_mm : float
        Position in the drawing.
    """

    x_px: float
    y_px: float
    x_mm: float
    y_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A drawing placed on a picture.

    Parameters
    ----------
    place : Placement
        Position, rotation and scale of the drawing.
    body_is_dark : bool
        Whether the mechanism is darker than the background.
    notes : tuple of str
        Remarks that a reader must know.
    """

    place: Placement
    body_is_dark: bool
    notes: tuple[str, ...]


def parse_point(text: str) -> GivenPoint:
    """Parse a point given as `X,Y=XMM,YMM`.

    Raises
    ------
    UsageError
        The text does not state a point in pixels and in millimetres.
    """
    try:
        (x_px, y_px), (x_mm, y_mm) = (tuple(map(float, half.split(","))) for half in text.split("="))
        is_point = bool(np.isfinite([x_px, y_px, x_mm, y_mm]).all())
    except ValueError:
        is_point = False
    if not is_point:
        raise UsageError(
            f"--at must be X,Y=XMM,YMM, a point in pixels and the same point of the drawing in mm, such as "
            f"312,80=2,100, but is {text}."
        )
    return GivenPoint(x_px, y_px, x_mm, y_mm)


def by_points(points: Sequence[GivenPoint], px_per_mm: float, flat: FlatMap | None = None) -> Placement:
    """Place a drawing by given points.

    With two points the front of the drawing is assumed to face the camera; three points also determine which side is
    seen.

    Raises
    ------
    UsageError
        Too few points are given, or their distances contradict the scale.
    """
    if len(points) < 2:
        raise UsageError(f"--at must be given for at least two points of the drawing, but is given for {len(points)}.")
    px = np.array([(p.x_px, p.y_px) for p in points]).T
    px = px if flat is None else flat.to_flat(px)
    mm = np.array([(p.x_mm, p.y_mm) for p in points]).T
    here, there = px - px.mean(axis=1)[:, None], mm - mm.mean(axis=1)[:, None]
    size = float(np.sqrt(np.sum(there**2)))
    if size == 0.0 or float(np.sqrt(np.sum(here**2))) == 0.0:
        raise UsageError("--at must give points at different places, but two of them are the same.")
    scale = float(np.sqrt(np.sum(here**2))) / size
    if abs(scale / px_per_mm - 1.0) > OTHER_SCALE:
        raise UsageError(
            f"The distances between the points of --at must agree with the scale of {px_per_mm:g} px/mm, but "
            f"correspond to {scale:.4g} px/mm: check the points, the drawing's lengths and the calibration."
        )
    found = []
    for is_mirrored in (False, True) if len(points) > 2 else (False,):
        flipped = there * np.array([[1.0], [1.0 if is_mirrored else -1.0]])
        angle = float(np.arctan2(np.sum(flipped[0] * here[1] - flipped[1] * here[0]), np.sum(flipped * here)))
        place = Placement(px_per_mm, np.zeros(2), angle, is_mirrored, flat)
        place = replace(place, origin_px=px.mean(axis=1) - px_per_mm * place.axes @ mm.mean(axis=1))
        found.append((float(np.sum((place.to_flat_px(mm) - px) ** 2)), is_mirrored, place))
    return min(found, key=lambda entry: entry[:2])[2]


def by_silhouette(grey: Array, mechanism: Mechanism, px_per_mm: float, flat: FlatMap | None = None) -> Placed:
    """Place a drawing so that its silhouette covers the dark, or the light, area of the picture.

    Raises
    ------
    DataError
        The drawing fits the picture nowhere, or equally well in several ways.
    """
    height, width = grey.shape
    step = max(1, max(width, height) // GRID)
    small = grey[::step, ::step]
    level, _ = cv2.threshold(_bytes(small), 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    is_light = _bytes(small) > level
    found: list[tuple[float, Placement, bool]] = []
    for body_is_dark, mask in ((True, ~is_light), (False, is_light)):
        rows, columns = np.nonzero(mask)
        if not rows.size:
            continue
        middle = step * np.array([columns.mean(), rows.mean()])
        middle = middle if flat is None else flat.to_flat(middle[:, None])[:, 0]
        for is_mirrored in (False, True):
            for angle in np.linspace(-np.pi, np.pi, TURNS, endpoint=False):
                place = Placement(px_per_mm, np.zeros(2), float(angle), is_mirrored, flat)
                place = _centred(place, mechanism, middle)
                rough = silhouette(mechanism, place, width, height, SKIPPED * step)
                overlap = _overlap(mask[::SKIPPED, ::SKIPPED], rough)
                found.append((overlap, place, body_is_dark))
    found.sort(key=lambda entry: -entry[0])
    best: list[tuple[float, Placement, bool]] = []
    for overlap, place, body_is_dark in found:
        if len(best) < 4 and not any(_near(place, other[1]) for other in best):
            mask = ~is_light if body_is_dark else is_light
            best.append((*_climbed(mask, mechanism, place, (width, height, step), overlap), body_is_dark))
    best.sort(key=lambda entry: -entry[0])
    if not best or best[0][0] < LEAST_OVERLAP:
        share = best[0][0] if best else 0.0
        raise DataError(
            f"The drawing {mechanism.name} must cover the mechanism that the picture shows, but at best only "
            f"{100.0 * share:.0f} % of the two areas overlap: show the whole mechanism, check the scale, or give "
            "--at X,Y=XMM,YMM for three points."
        )
    top = best[0]
    # Two of the first placements may have climbed to the same one.
    others = [entry for entry in best[1:] if entry[0] > top[0] - AS_GOOD and not _near(entry[1], top[1])]
    if not others:
        return Placed(top[1], top[2], ())
    drawn = silhouette(mechanism, top[1], width, height, step) > 0.5
    size = (width, height, step)
    if any(_climbed(drawn, mechanism, entry[1], size, 0.0)[0] < ALIKE for entry in others):
        raise DataError(
            f"The drawing {mechanism.name} fits the picture equally well in {1 + len(others)} ways: give --at "
            "X,Y=XMM,YMM for three points of the drawing."
        )
    # For a symmetric drawing, the placement with its front towards the camera and the smallest rotation is chosen.
    chosen = min((top, *others), key=lambda entry: (entry[1].is_mirrored, abs(_wrapped(entry[1].angle_rad))))
    note = (
        "the drawing is symmetric and fits the picture in several ways; the placement with its front towards the "
        "camera and the smallest rotation was chosen. Give --at for three points to choose another placement."
    )
    return Placed(chosen[1], chosen[2], (note,))


@dataclass(frozen=True, slots=True, eq=False)
class Laid:
    """A drawing whose placement was fitted to its edges.

    Parameters
    ----------
    place : Placement
        Position, rotation and scale of the drawing.
    fit : RigidFit
        Fit of the edges, relative to the initial placement.
    about_px : ndarray of float, shape (2,)
        Point about which the rotation was fitted, at its fitted position in the undistorted plane.
    by_fixed : bool
        Whether the fitted edges are those of fixed bodies.
    """

    place: Placement
    fit: RigidFit
    about_px: Array
    by_fixed: bool


def refined(
    grey: Array, outlines: Sequence[BodyOutline], place: Placement, body_is_dark: bool, view: EdgeView = PLAIN
) -> Laid | None:
    """Refine the placement by the edges of the fixed bodies, or of all bodies if no fixed body is in view.

    The function returns None if too few edges are found.
    """
    height, width = grey.shape
    cut = [outline.chunks(place) for outline in outlines]
    shares = in_sight(cut, width, height, place.flat)
    fixed = [c for c, o, share in zip(cut, outlines, shares, strict=True) if o.body.is_fixed and share > 0.5]
    chunks = together(fixed or cut)
    about = chunks.middles.mean(axis=1)
    found = capture_rigid(grey, halved(grey, LEVELS), chunks, about, body_is_dark, (np.zeros(2), 0.0), view)
    if found is None or found.seen < LEAST_LAID * found.in_view:
        return None
    angle = place.angle_rad + found.angle_rad
    turn = np.array([[np.cos(found.angle_rad), -np.sin(found.angle_rad)],
                     [np.sin(found.angle_rad), np.cos(found.angle_rad)]])  # fmt: skip
    exact = replace(place, angle_rad=angle, origin_px=turn @ (place.origin_px - about) + about + found.shift_px)
    return Laid(exact, found, about + found.shift_px, bool(fixed))


def together(parts: Sequence[Chunks]) -> Chunks:
    """Join the outline pieces of several bodies into one body."""
    return Chunks(
        np.concatenate([part.middles for part in parts], axis=1),
        np.concatenate([part.normals for part in parts], axis=1),
        parts[0].half_length,
        np.concatenate([part.bends for part in parts], axis=0),
    )


def levels_of(grey: Array, mechanism: Mechanism, place: Placement) -> tuple[float, float]:
    """Median level of the mechanism in the picture, and of the background."""
    height, width = grey.shape
    step = max(1, max(width, height) // GRID)
    inside = silhouette(mechanism, place, width, height, step) > 0.5
    small = grey[::step, ::step]
    if inside.all() or not inside.any():
        raise DataError(
            f"The drawing {mechanism.name} must lie inside the picture and leave some background visible, but covers "
            f"{'all' if inside.any() else 'none'} of the picture: check --at and the scale."
        )
    return float(np.median(small[inside])), float(np.median(small[~inside]))


def _bytes(grey: Array) -> NDArray[np.uint8]:
    low, high = float(grey.min()), float(grey.max())
    return np.asarray((grey - low) * (255.0 / max(high - low, 1e-9)), dtype=np.uint8)


def _centred(place: Placement, mechanism: Mechanism, middle_px: Array) -> Placement:
    x, y = np.meshgrid(*(np.linspace(low, high, 60) for low, high in _box_mm(mechanism)))
    points = np.stack([x.ravel(), y.ravel()])
    centre = points[:, mechanism.region.holds(points)].mean(axis=1)
    return replace(place, origin_px=middle_px - place.px_per_mm * place.axes @ centre)


def _box_mm(mechanism: Mechanism) -> list[tuple[float, float]]:
    ends = np.concatenate([c.at(np.linspace(c.t0, c.t1, 9)) for added, shape in mechanism.bodies if added
                           for c in shape.curves()], axis=1)  # fmt: skip
    return [(float(low), float(high)) for low, high in zip(ends.min(axis=1), ends.max(axis=1), strict=True)]


def _overlap(mask: NDArray[np.bool_], drawn: Array) -> float:
    inside = drawn[: mask.shape[0], : mask.shape[1]] > 0.5
    return float(np.sum(mask & inside)) / max(float(np.sum(mask | inside)), 1.0)


def _near(one: Placement, other: Placement) -> bool:
    return one.is_mirrored == other.is_mirrored and abs(_wrapped(one.angle_rad - other.angle_rad)) < APART_RAD


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _climbed(
    mask: NDArray[np.bool_], mechanism: Mechanism, place: Placement, size: tuple[int, int, int], overlap: float
) -> tuple[float, Placement]:
    """Rotate and shift a drawing in steps that are halved, as long as its overlap with the mask grows."""
    width, height, step = size
    turn, shift = np.pi / TURNS, 6.0 * step
    while shift > 0.5 * step:
        middle = 0.5 * np.array([width, height])
        trials = [replace(place, origin_px=place.origin_px + shift * np.array(way))
                  for way in ((1, 0), (-1, 0), (0, 1), (0, -1))]  # fmt: skip
        for sign in (-1.0, 1.0):
            c, s = np.cos(sign * turn), np.sin(sign * turn)
            origin = np.array([[c, -s], [s, c]]) @ (place.origin_px - middle) + middle
            trials.append(replace(place, angle_rad=place.angle_rad + sign * turn, origin_px=origin))
        scored = [
            (_overlap(mask, silhouette(mechanism, trial, width, height, step)), n) for n, trial in enumerate(trials)
        ]
        better = max(scored)
        if better[0] > overlap:
            overlap, place = better[0], trials[better[1]]
        else:
            turn, shift = 0.5 * turn, 0.5 * shift
    return overlap, place
