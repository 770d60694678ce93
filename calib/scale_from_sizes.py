"""Scale and edge bias from objects of known size."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from calib.errors import CalibrationError
from calib.known_widths import KnownSize, find_widths
from calib.limits import Limits, rectangular
from calib.measured_scale import Calibration, Reference, Response, ScalePart
from calib.parallel_edges import ParallelEdges
from calib.picture_shift import change_of_distance_px, lens_shift_px, tilt_shift_px
from calib.short_repr import ShortRepr
from calib.straight_line import StraightLine, line_through_origin, line_with_errors

Floats = NDArray[np.float64]

# Probability of a chi-square below which the residuals are regarded as a misfit, which enlarges the covariance and is
# reported.
CHANCE = 0.01
# Relative difference below which sizes count as equal.
SAME_SIZE = 0.01


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MeasuredSize(ShortRepr):
    """One object of known size, measured in the picture.

    Parameters
    ----------
    reference : Reference
        Certified size of the object.
    width_px, u_width_px : float
        Width in the picture, corrected for lens and plane, and its standard uncertainty from the fit of the edges.
    points_px : ndarray, shape (2, 2)
        End points of the width.
    light : bool
        Whether the area between the edges is light.
    """

    reference: Reference
    width_px: float
    u_width_px: float
    points_px: Floats
    light: bool

    @classmethod
    def of(cls, known: KnownSize, edges: ParallelEdges, certificate: str = "", date: str = "") -> "MeasuredSize":
        """Combine the certified size in a picture with the edges that `find_widths` found there."""
        what = f"{known.kind} {known.name}"
        reference = Reference(what, known.size_mm, known.u_size_mm, certificate, date)
        return cls(reference, edges.width_px, edges.u_width_px, edges.points_px, edges.light)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ScaleFit(ShortRepr):
    """The calibration from objects of known size, with the residuals of the fitted straight line.

    Parameters
    ----------
    calibration : Calibration
        The result.
    bias_known : bool
        Whether the edge bias was determined; otherwise it is set to zero, with its limit as an uncertainty.
    residual_mm : ndarray, shape (n,)
        Linearity residuals: measured minus certified size of each object.
    chi_square : float
        Chi-square of the residuals, relative to the uncertainties of sizes, edges, lens and perspective.
    freedom : int
        Degrees of freedom; 0 if the line cannot be checked.
    probability : float
        Probability of a `chi_square` at least as large by chance.
    """

    calibration: Calibration
    bias_known: bool
    residual_mm: Floats
    chi_square: float
    freedom: int
    probability: float


def scale_from_pictures(
    pictures: Sequence[KnownSize],
    region: tuple[int, int, int, int] | None = None,
    limits: Limits | None = None,
    stated: frozenset[str] = frozenset(),
) -> ScaleFit:
    """Measure bars and slots of known size in their pictures, and fit scale and edge bias to them.

    Parameters
    ----------
    pictures : sequence of KnownSize
        At least one picture; all have the same size in pixels and the same scale.
    region : tuple of int, optional
        x, y, width and height of the part of every picture to be searched.
    limits, stated
        As in `scale_from_sizes`.

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
    >>> fit = calib.scale_from_pictures(known)
    >>> print(f"{fit.calibration.px_per_mm:.2f} px/mm, U = {2.0 * fit.calibration.u_px_per_mm:.2f} px/mm")
    40.00 px/mm, U = 0.03 px/mm

    A distance between two points of a light gap, with its uncertainty and where it comes from:

    >>> ends_px = np.array([[[100.0, 150.0], [300.0, 150.0]]])
    >>> given = ends_px, np.array([0.02]), np.array([True])
    >>> fit.calibration.distances(*given)
    Distances(value_mm=array([5.]), u_mm=array([0.015...]), u_random_mm=array([0.0005]))
    >>> budget = fit.calibration.budget(*given)
    >>> max(budget.lines, key=lambda line: line.u_mm[0]).source
    'distance from the calibrated plane'
    """
    if len({known.grey.shape for known in pictures}) > 1:
        told = ", ".join(f"{known.name} {known.grey.shape[1]}x{known.grey.shape[0]}" for known in pictures)
        raise CalibrationError(f"All pictures must have the same size in pixels, but their sizes are {told}.")
    sizes = [MeasuredSize.of(*each) for each in zip(pictures, find_widths(pictures, region), strict=True)]
    height, width = pictures[0].grey.shape
    return scale_from_sizes(sizes, (width, height), limits, stated)


def scale_from_sizes(
    sizes: Sequence[MeasuredSize],
    frame_size_px: tuple[int, int],
    limits: Limits | None = None,
    stated: frozenset[str] = frozenset(),
    response_shift_px: float = 0.0,
) -> ScaleFit:
    """Fit gap_mm = (gap_px + p b) / s to objects of known size, with p = +1 for a light gap and -1 for a dark object.

    Written as a straight line with the slope s, the equation is p gap_px = s (p gap_mm) - b. Three different sizes, or
    a light gap and a dark object, determine scale s and edge bias b; fewer objects determine only s, and b is included
    in the uncertainty budget with its limit.

    Parameters
    ----------
    sizes : sequence of MeasuredSize
        At least one measured object.
    frame_size_px : tuple of int
        Width and height of the pictures.
    limits, stated
        Limits of the set-up's imperfections (None takes the defaults), and the names of those that the user stated.
    response_shift_px : float
        Largest excess of a light gap's measured width because the camera response is assumed; 0 if the response is
        known. The true excess lies between 0 and this value; the standard uncertainty is that of a rectangular
        distribution of this half-width. If the edge bias is determined, it includes this effect.

    Examples
    --------
    Widths that were measured in another way:

    >>> import numpy as np, calib
    >>> ends_px = np.array([[160.0, 150.0], [280.0, 150.0]])
    >>> sizes = [
    ...     calib.MeasuredSize(calib.Reference(f"bar {mm}", mm, 0.001), 40.0 * mm - 0.4, 0.02, ends_px, light=False)
    ...     for mm in (3.0, 5.0, 7.0)
    ... ]
    >>> fit = calib.scale_from_sizes(sizes, (440, 300))
    >>> print(f"{fit.calibration.px_per_mm:.2f} px/mm, edge bias {fit.calibration.edge_bias_px:.2f} px")
    40.00 px/mm, edge bias -0.40 px
    """
    if not sizes:
        raise CalibrationError("A scale needs at least one object of known size, but there is none.")
    limits = limits or Limits()
    polarity = np.array([1.0 if size.light else -1.0 for size in sizes])
    x = polarity * np.array([size.reference.size_mm for size in sizes])
    y = polarity * np.array([size.width_px for size in sizes])
    u_x = np.array([size.reference.u_size_mm for size in sizes])
    u_y = np.hypot([size.u_width_px for size in sizes], np.sqrt(2.0) * rectangular(limits.estimator_px))
    # Least standard uncertainty of a width; an uncertainty of zero would give one picture all the weight.
    u_y = np.maximum(u_y, 1e-4)
    bias_known = _different(x) >= 3 or len(set(polarity.tolist())) == 2
    line = line_with_errors(x, y, u_x, u_y) if bias_known else line_through_origin(x, y, u_x, u_y)
    to_scale_and_bias = np.array([[1.0], [-1.0]]) * line.response
    parts = [
        ScalePart("reference size", _spread(to_scale_and_bias, line.slope * u_x), "the certificate (--u-size-mm)"),
        ScalePart("reference edges", _spread(to_scale_and_bias, u_y), "the fit of the reference's edges"),
    ]
    if not bias_known:
        by_bias = np.array([-float(line.response[0].sum()), -1.0])
        covariance = np.outer(by_bias, by_bias) * rectangular(limits.edge_bias_px) ** 2
        how = f"+-{limits.edge_bias_px:g} px ({'stated' if 'edge_bias_px' in stated else 'default'})"
        parts.append(
            ScalePart("edge bias", covariance, f"{how}; three sizes, or a bar and a slot, determine the edge bias")
        )
        if response_shift_px:
            shifted = np.outer(by_bias, by_bias) * rectangular(response_shift_px) ** 2
            how = f"0 to {response_shift_px:.2g} px; state or measure the response (--response)"
            parts.append(ScalePart("camera response", shifted, how))
    lens, tilt = _seen_through(sizes, polarity, frame_size_px, limits.camera_distance_mm * line.slope)
    expected = np.diag(u_y**2 + (line.slope * u_x) ** 2) + np.outer(lens, lens) * rectangular(limits.lens_relative) ** 2
    expected += (tilt.T @ tilt) * rectangular(limits.tilt_rad) ** 2
    if not bias_known:
        expected += rectangular(limits.edge_bias_px) ** 2 + rectangular(response_shift_px) ** 2
    chi_square = _chi_square(line, x, expected, bias_known)
    probability = float(chdtrc(line.freedom, chi_square)) if line.freedom > 0 else 1.0
    if probability < CHANCE:
        excess = chi_square / line.freedom - 1.0
        found = np.sum([part.covariance for part in parts[:2]], axis=0)
        parts.append(ScalePart("misfit of the straight line", excess * found, "the linearity residuals (Birge ratio)"))
    calibration = Calibration(
        px_per_mm=line.slope,
        edge_bias_px=-line.intercept if bias_known else 0.0,
        parts=tuple(parts),
        frame_size_px=frame_size_px,
        limits=limits,
        stated=stated,
        response=Response(lens=to_scale_and_bias @ lens, tilt=np.array([to_scale_and_bias @ each for each in tilt])),
        references=tuple(size.reference for size in sizes),
    )
    return ScaleFit(
        calibration=calibration,
        bias_known=bias_known,
        residual_mm=polarity * line.residual / line.slope,
        chi_square=chi_square,
        freedom=line.freedom,
        probability=probability,
    )


def _different(sizes: Floats) -> int:
    ordered = np.sort(sizes)
    return 1 + int(np.count_nonzero(np.diff(ordered) > SAME_SIZE * np.abs(ordered[1:])))


def _spread(response: Floats, u: Floats) -> Floats:
    return np.asarray((response * u**2) @ response.T)


def _seen_through(
    sizes: Sequence[MeasuredSize], polarity: Floats, frame_size_px: tuple[int, int], distance_px: float
) -> tuple[Floats, Floats]:
    """Change of each signed width per unit of lens distortion, shape (n,), and per radian of tilt, shape (2, n)."""
    points = np.array([size.points_px for size in sizes])
    lens = change_of_distance_px(points, lens_shift_px(points, frame_size_px))
    tilt = [change_of_distance_px(points, tilt_shift_px(points, frame_size_px, distance_px, axis)) for axis in (0, 1)]
    return np.asarray(polarity * lens), np.asarray(polarity * np.array(tilt))


def _chi_square(line: StraightLine, x: Floats, covariance: Floats, bias_known: bool) -> float:
    """Chi-square of the residuals, with lens distortion fitted within its limit."""
    design = np.stack([x, np.ones_like(x)], axis=1) if bias_known else x[:, None]
    inverse = np.linalg.inv(covariance)
    refit = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse @ line.residual)
    left = line.residual - design @ refit
    return float(left @ inverse @ left)
