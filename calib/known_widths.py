"""Bars and slots of known size: selection, in each picture, of the pair of edges whose distance was certified."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError
from calib.parallel_edges import ParallelEdges
from calib.short_repr import ShortRepr
from calib.straight_edges import find_edge_pairs, has_square_end, straight_edges_in_view

Grey = NDArray[np.uint8] | NDArray[np.uint16]

KINDS = ("bar", "slot")
# Smallest length of an object's edges as a share of the longest edge; shorter edges belong to chips and shadows.
SHORTEST_OF_LONGEST = 0.2
# Ratio of edge lengths above which the distance between the longer edges is used, if a completely visible rectangle has
# two possible widths and other pictures do not decide.
CLEARLY_LONGER = 1.3
# Largest relative difference between the scales of pictures of one scene: more than blooming causes, and much less than
# a wrong unit.
SAME_SCALE = 0.06
# Factors between a size in a wrong unit and the size in millimetres, with their words.
WRONG_UNITS = {0.1: "ten", 10.0: "ten", 25.4: "25.4", 1.0 / 25.4: "25.4", 0.001: "a thousand", 1000.0: "a thousand"}
# The best combination of widths is used if the second best disagrees by more than the first value, which noise does not
# cause, and the best disagrees by less than this share of it.
NOT_NOISE, CLEARLY_BETTER = 0.01, 0.3
# Largest number of pictures for which combinations are tried; with more pictures, the distances between the longer
# edges are used.
MOST_COMBINED = 12


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class KnownSize(ShortRepr):
    """A picture of an object whose size is known.

    Parameters
    ----------
    name : str
        Name of the picture in error messages.
    kind : str
        "bar" (an object) or "slot" (a gap between objects).
    size_mm, u_size_mm : float
        Certified size and its standard uncertainty.
    grey : ndarray, shape (height, width)
        Original grey levels, of any type and full scale.

    Raises
    ------
    CalibrationError
        The kind is another word, the array has colours, or the size or its uncertainty is impossible.
    """

    name: str
    kind: str
    size_mm: float
    u_size_mm: float
    grey: Grey

    def __post_init__(self) -> None:
        """Refuse an impossible size."""
        if self.kind not in KINDS:
            raise CalibrationError(f"The kind of {self.name} must be 'bar' or 'slot', but is {self.kind!r}.")
        if np.ndim(self.grey) != 2:
            raise CalibrationError(
                f"{self.name} must be an array of grey levels of shape (height, width), but its shape is "
                f"{np.shape(self.grey)}: convert colours to grey first, such as by .mean(axis=2)."
            )
        if not (isfinite(self.size_mm) and self.size_mm > 0.0):
            raise CalibrationError(f"The size of {self.name} must be positive, but is {self.size_mm} mm.")
        if not (isfinite(self.u_size_mm) and self.u_size_mm >= 0.0):
            raise CalibrationError(
                f"The uncertainty of the size of {self.name} must be zero or more, but is {self.u_size_mm} mm."
            )


def find_widths(
    pictures: Sequence[KnownSize],
    region: tuple[int, int, int, int] | None = None,
    px_per_mm: float | None = None,
) -> list[ParallelEdges]:
    """Find and measure the certified width in every picture.

    Parameters
    ----------
    pictures : sequence of KnownSize
        At least one picture; all have the same scale.
    region : tuple of int, optional
        x, y, width and height of the part of every picture to be searched.
    px_per_mm : float, optional
        The scale, if already known.

    Raises
    ------
    CalibrationError
        If there is no object, several objects, a clipped flank, or sizes that contradict each other.

    Examples
    --------
    >>> import numpy as np, calib
    >>> def bar(width_px):
    ...     away = np.abs(np.arange(440) - 219.6) - 0.5 * width_px
    ...     return np.rint(np.tile(220.0 - 180.0 * np.clip(0.5 - away, 0.0, 1.0), (300, 1))).astype(np.uint8)
    >>> known = [calib.KnownSize(f"{mm} mm", "bar", mm, 0.001, bar(40.0 * mm)) for mm in (3.0, 5.0, 7.0)]
    >>> [round(edges.width_px, 1) for edges in calib.find_widths(known)]
    [120.0, 200.0, 280.0]
    """
    choices = [_choices(picture, find_edge_pairs(picture.grey, region), region) for picture in pictures]
    widths = _settled(pictures, choices) if px_per_mm is None else _expected(pictures, choices, px_per_mm)
    if px_per_mm is None and len(pictures) == 1 and len(choices[0]) == 1:
        _refuse_cut(pictures[0], widths[0], region)
    for picture, width in zip(pictures, widths, strict=True):
        if width.clipped:
            raise CalibrationError(
                f"The flank of an edge in {picture.name} is clipped at the sensor's full scale, so that its position "
                "is unknown: reduce the exposure or the light, and take the picture again."
            )
    return widths


def _choices(
    picture: KnownSize, pairs: Sequence[ParallelEdges], region: tuple[int, int, int, int] | None
) -> list[ParallelEdges]:
    """List the possible widths of an object: one width, or two widths for a rectangle that is completely visible.

    If there are two possible widths, the pair with the longer edges comes first.
    """
    where = "the region" if region is not None else "the picture"
    if not pairs:
        edges = straight_edges_in_view(picture.grey, region)
        if edges:
            raise CalibrationError(
                f"{picture.name} must show two parallel straight edges in {where}, but shows {edges} straight edge"
                f"{'s' if edges > 1 else ''} without a parallel edge: bring both edges of the {picture.kind} into "
                "view, away from the border, or give a region with --roi."
            )
        raise CalibrationError(
            f"{picture.name} must show a {picture.kind} with two parallel straight edges, but there is no straight "
            f"edge in {where}: check the picture, its light and its focus."
        )
    longest = max(pair.length_px for pair in pairs)
    pairs = [pair for pair in _of_kind(picture.kind, pairs) if pair.length_px >= SHORTEST_OF_LONGEST * longest]
    objects: list[list[ParallelEdges]] = []
    for pair in pairs:
        one = next((found for found in objects if _one_object(found[0], pair)), None)
        if one is None:
            objects.append([pair])
        else:
            one.append(pair)
    if len(objects) > 1:
        named = ", ".join(found[0].words() for found in objects[:5])
        raise CalibrationError(
            f"{picture.name} must show one {picture.kind}, but there are {len(objects)} candidates in {where} "
            f"({named}): choose one of them by --roi X,Y,W,H."
        )
    return objects[0][:2]


def _of_kind(kind: str, pairs: Sequence[ParallelEdges]) -> list[ParallelEdges]:
    """Bars or slots among pairs of edges: an outermost pair is a bar, a pair between two bars is a slot."""
    if len({pair.light for pair in pairs}) == 1:
        return list(pairs)
    main = pairs[0]
    across = (main.points_px[1] - main.points_px[0]) / main.width_px
    parallel = [pair for pair in pairs if abs(float(np.diff(pair.points_px, axis=0)[0] @ across)) > 0.9 * pair.width_px]
    outermost = min(parallel, key=lambda pair: float(pair.middle_px @ across))
    mixed = len({pair.light for pair in parallel}) > 1
    light = outermost.light == (kind == "bar") if mixed else kind == "slot"
    return [pair for pair in pairs if pair.light == light]


def _one_object(pair: ParallelEdges, other: ParallelEdges) -> bool:
    across, other_across = (np.diff(each.points_px, axis=0)[0] / each.width_px for each in (pair, other))
    apart = float(np.linalg.norm(pair.middle_px - other.middle_px))
    return bool(abs(across @ other_across) < 0.3) and apart < 0.25 * max(pair.width_px, other.width_px)


def _refuse_cut(picture: KnownSize, width: ParallelEdges, region: tuple[int, int, int, int] | None) -> None:
    """Refuse a rectangle with three visible sides, because the certified width may include the fourth."""
    if width.length_px < CLEARLY_LONGER * width.width_px and has_square_end(picture.grey, region, width):
        raise CalibrationError(
            f"{picture.name} shows three sides of a rectangle, and the certified width of {picture.size_mm:g} mm may "
            f"extend beyond the border: bring the whole width into view; or, if the certified width is that of "
            f"{width.width_px:.1f} px between the two parallel sides, give a region with --roi that excludes the "
            "third side."
        )


def _expected(
    pictures: Sequence[KnownSize], choices: Sequence[Sequence[ParallelEdges]], px_per_mm: float
) -> list[ParallelEdges]:
    widths = []
    for picture, found in zip(pictures, choices, strict=True):
        nearest = min(found, key=lambda pair: abs(pair.width_px - picture.size_mm * px_per_mm))
        if not 0.8 < nearest.width_px / (picture.size_mm * px_per_mm) < 1.25:
            raise CalibrationError(
                f"{picture.name} is stated to be {picture.size_mm:g} mm, but according to the calibration its size is "
                "about "
                f"{nearest.width_px / px_per_mm:.4g} mm: check the object, and that the size is in millimetres."
            )
        widths.append(nearest)
    return widths


def _settled(pictures: Sequence[KnownSize], choices: Sequence[Sequence[ParallelEdges]]) -> list[ParallelEdges]:
    """Choose the widths that agree on one scale (px/mm)."""
    sizes = np.array([picture.size_mm for picture in pictures])
    longer_edges = [found[0] for found in choices]
    combinations = [list(each) for each in product(*choices)] if len(choices) <= MOST_COMBINED else [longer_edges]
    agreeing = [each for each in combinations if _disagreement(each, sizes) < SAME_SCALE]
    if not agreeing:
        _refuse_unit(pictures, combinations, sizes)
        _refuse_sizes(pictures, min(combinations, key=lambda each: _disagreement(each, sizes)), sizes)
    agreeing.sort(key=lambda each: _disagreement(each, sizes))
    if len(agreeing) == 1:
        return agreeing[0]
    best, next_best = (_disagreement(each, sizes) for each in agreeing[:2])
    if next_best > NOT_NOISE and best < CLEARLY_BETTER * next_best:
        return agreeing[0]
    for picture, found in zip(pictures, choices, strict=True):
        if len(found) > 1 and found[0].length_px < CLEARLY_LONGER * found[1].length_px:
            raise CalibrationError(
                f"{picture.name} shows a rectangle of {found[0].width_px:.1f} px by {found[1].width_px:.1f} px, and "
                f"either side could have the size of {picture.size_mm:g} mm: give a region with --roi that contains "
                "only the two edges to be measured."
            )
    return longer_edges if any(each == longer_edges for each in agreeing) else agreeing[0]


def _disagreement(widths: Sequence[ParallelEdges], sizes: NDArray[np.float64]) -> float:
    scales = np.array([width.width_px for width in widths]) / sizes
    return float(scales.max() / scales.min() - 1.0)


def _refuse_unit(
    pictures: Sequence[KnownSize], combinations: Sequence[Sequence[ParallelEdges]], sizes: NDArray[np.float64]
) -> None:
    """Refuse sizes for which another unit of a single size would make all pictures agree."""
    for index, picture in enumerate(pictures):
        for factor, words in WRONG_UNITS.items():
            other = sizes.copy()
            other[index] *= factor
            if any(_disagreement(each, other) < SAME_SCALE for each in combinations):
                # With two pictures, the size of either picture may be wrong.
                others = "" if len(pictures) > 2 else f" (or {pictures[1 - index].name} is wrong by the inverse factor)"
                raise CalibrationError(
                    f"All pictures must have one scale, but {picture.name} would have to be {other[index]:.4g} mm "
                    f"instead of {picture.size_mm:g} mm, a factor of {words}, to agree with the other pictures"
                    f"{others}: state every size in millimetres."
                )


def _refuse_sizes(pictures: Sequence[KnownSize], widths: Sequence[ParallelEdges], sizes: NDArray[np.float64]) -> None:
    scales = np.array([width.width_px for width in widths]) / sizes
    odd = int(np.argmax(np.abs(np.log(scales / float(np.median(scales))))))
    others = float(np.median(np.delete(scales, odd)))
    raise CalibrationError(
        f"All pictures must have one scale, but {pictures[odd].name} of {pictures[odd].size_mm:g} mm gives "
        f"{scales[odd]:.4g} px/mm and the others give {others:.4g}: check the sizes, and that the camera was not "
        "moved or refocused between the pictures."
    )
