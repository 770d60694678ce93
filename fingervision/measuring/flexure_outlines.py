"""Thickness and place of every flexure in a still frame, from the area that its profiles cut out of the background.

Across a flexure, the light that is missing from the background, divided by the contrast, is the flexure's thickness,
and its centre of gravity is the flexure's middle, whatever the blur is, as long as the blur is symmetric. Errors of the
tone curve and of the drawing's fillets change every recording alike: the differences between two recordings of the same
specimen are known better than the values.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from fingervision.domain.body_poses import FlexureOutline
from fingervision.measuring.body_outlines import Placement
from fingervision.models.flexure import Flexure

Array = NDArray[np.float64]
Measured = tuple[float, float | None, float] | None

STATIONS = 13
"""Number of profiles along a flexure: its neck is then found from a curve instead of a single profile."""
REACH = {"leaf": 0.35, "filleted": 0.9}
"""Part of the half length on either side of the middle in which profiles lie; a leaf ends inside the bodies."""
REACH_OF_NOTCH = 0.55
BESIDE_PX = 6.0
"""Background beside a flexure that a profile contains: three times a blur of 1.5 px, and some pixels of background."""
GROUND_PX = 2.0
"""Width at either end of a profile, over which the level of the background is averaged."""
LEAST_BESIDE_PX = 3.5
"""Least background beside a flexure; with less, the blurred edge reaches the end of the profile."""
FINE = 4
"""Points per pixel across a flexure; the picture is interpolated by cubic splines."""
FITS, NEAR_MM = 4, 0.01
"""Gauss-Newton steps of thickness and place along the axis, and step of the derivative of the height."""
CENTRED = 2
"""Number of times that a profile is centred on the flexure: one that is displaced by 2 px would leave the background on
one side out, and appear 20 um thinner."""
PHASE_PX = 0.015
"""Standard uncertainty of thickness and place from the edges' positions on the pixels, which is the same in all still
frames (`python -m tests.benchmarks.healthy_reference` prints the errors)."""
STILL_PX = 0.1
"""Motion of a flexure since the first frame above which the mechanism is no longer at rest: five times the noise of its
place."""
LEAST_CONTRAST = 0.2
"""Least difference of body and background, relative to that of the whole picture."""


@dataclass(frozen=True, slots=True, eq=False)
class StillPicture:
    """A frame of the mechanism at rest, with the drawing placed on it.

    Parameters
    ----------
    light : ndarray of float, shape (height, width)
        Levels proportional to light.
    place : Placement
        Position of the drawing.
    body, ground : float
        Levels of the bodies and of the background.
    outward_px : float
        Distance by which an edge appears outside its body (edge bias).
    """

    light: Array
    place: Placement
    body: float
    ground: float
    outward_px: float


def flexure_outline(picture: StillPicture, flexure: Flexure) -> Measured:
    """Measure thickness, and place along and across the axis relative to the drawing (mm), in one picture.

    The place along the axis is None for a flexure of constant height. The function returns None if the flexure is not
    in view with background on both sides.
    """
    mm = 1.0 / picture.place.px_per_mm
    reach = REACH.get(flexure.kind, REACH_OF_NOTCH) * flexure.half_length_mm
    along = np.linspace(-reach, reach, STATIONS)
    drawn = flexure.height_mm(along)
    beside = min(BESIDE_PX * mm, 0.8 * flexure.depth_mm) if flexure.depth_mm else BESIDE_PX * mm
    if beside < LEAST_BESIDE_PX * mm:
        return None
    heights, middles = np.empty(STATIONS), np.empty(STATIONS)
    for k in range(STATIONS):
        at, half, found = float(along[k]), 0.5 * float(drawn[k]) + beside, None
        for _ in range(CENTRED):
            found = _profile(picture, flexure, at, 0.0 if found is None else found[1], half)
            if found is None:
                return None
            heights[k], middles[k] = found
    heights -= 2.0 * picture.outward_px * mm
    thicker, moved = 0.0, 0.0
    bends = float(np.ptp(drawn)) > mm
    for _ in range(FITS):
        # A neck displaced along the axis by x0 has the height h(x - x0), and one that is thicker by d has h + d.
        height, slope = (
            flexure.height_mm(along - moved),
            (flexure.height_mm(along - moved + NEAR_MM) - flexure.height_mm(along - moved - NEAR_MM)) / (2.0 * NEAR_MM),
        )
        columns = np.stack([np.ones(STATIONS), -slope] if bends else [np.ones(STATIONS)], axis=1)
        step = np.linalg.lstsq(columns, heights - height - thicker, rcond=None)[0]
        thicker, moved = thicker + float(step[0]), moved + (float(step[1]) if bends else 0.0)
    across = float(np.polyfit(along, middles, 1)[1])
    return flexure.thickness_mm + thicker, moved if bends else None, across


def _profile(
    picture: StillPicture, flexure: Flexure, along_mm: float, about_mm: float, half_mm: float
) -> tuple[float, float] | None:
    """Height and middle (mm) of a flexure at one place along its axis, from the light that it takes away.

    The profile goes by `half_mm` to either side of `about_mm`.
    """
    per_mm = picture.place.px_per_mm
    count = 2 * int(np.ceil(FINE * half_mm * per_mm)) + 1
    across = about_mm + np.linspace(-half_mm, half_mm, count)
    x, y = picture.place.to_px(np.stack(flexure.point_mm(np.full(count, along_mm), across)))
    height, width = picture.light.shape
    if min(x.min(), y.min()) < 2.0 or x.max() > width - 3.0 or y.max() > height - 3.0:
        return None
    # Only the surroundings are interpolated: the spline of a whole picture would take most of the time.
    left, top = int(x.min()) - 8, int(y.min()) - 8
    part = picture.light[max(top, 0) : int(y.max()) + 9, max(left, 0) : int(x.max()) + 9]
    light = map_coordinates(part, [y - max(top, 0), x - max(left, 0)], order=3, mode="nearest")
    end = max(int(GROUND_PX * count / (2.0 * half_mm * per_mm)), 2)
    low, high = float(light[:end].mean()), float(light[-end:].mean())
    at = 0.5 * GROUND_PX / per_mm
    ground = low + (high - low) * (across - about_mm + half_mm - at) / (2.0 * half_mm - 2.0 * at)
    contrast = 0.5 * (low + high) - picture.body
    if contrast * (picture.ground - picture.body) <= 0.0:
        return None
    if abs(contrast) < LEAST_CONTRAST * abs(picture.ground - picture.body):
        return None
    missing = (ground - light) / contrast
    step = float(across[1] - across[0])
    area = float(np.sum(missing)) * step
    return (area, float(np.sum(missing * across)) * step / area) if area > 0.0 else None


def flexures_at_rest(pictures: Sequence[StillPicture], flexures: Sequence[Flexure]) -> list[FlexureOutline]:
    """Average thickness and place of every flexure over the first frames, until one of them moves.

    Flexures that are not in view are left out.
    """
    every = [[flexure_outline(picture, flexure) for flexure in flexures] for picture in pictures]
    found = []
    for number, flexure in enumerate(flexures):
        rows = (row[number] for row in every[: _still(every, pictures)])
        seen = [one for one in rows if one is not None]
        if not seen:
            continue
        floor = PHASE_PX / pictures[0].place.px_per_mm
        columns = [np.array([one[k] for one in seen], dtype=np.float64) for k in (0, 2)]
        thickness, across = ((float(c.mean()), _u(c, floor)) for c in columns)
        moved = [one[1] for one in seen if one[1] is not None]
        # The height of a notch changes little beside its neck, so that its place along the axis is less certain.
        along = (float(np.mean(moved)), _u(np.array(moved), 3.0 * floor)) if moved else None
        found.append(FlexureOutline(flexure.name, len(seen), thickness, along, across))
    return found


def _still(every: Sequence[Sequence[Measured]], pictures: Sequence[StillPicture]) -> int:
    """Number of frames, from the first one on, in which no flexure has moved since the first frame."""
    for count, (row, picture) in enumerate(zip(every, pictures, strict=True)):
        both = [
            (one[2], first[2])
            for one, first in zip(row, every[0], strict=True)
            if one is not None and first is not None
        ]
        if any(abs(here - there) > STILL_PX / picture.place.px_per_mm for here, there in both):
            return count
    return len(every)


def _u(values: Array, floor: float) -> float:
    scatter = float(values.std(ddof=1)) / float(np.sqrt(values.size)) if values.size > 1 else 0.0
    return float(np.hypot(scatter, floor))
