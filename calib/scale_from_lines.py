"""Scale from the lines of a line scale: a straight line fitted to position over line number."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from calib.errors import CalibrationError
from calib.limits import Limits, rectangular
from calib.line_scale import ScaleLines
from calib.measured_scale import Calibration, Reference, Response, ScalePart
from calib.picture_shift import lens_shift_px, tilt_shift_px
from calib.scale_from_sizes import CHANCE
from calib.short_repr import ShortRepr

Floats = NDArray[np.float64]

# Largest deviation of a line from its nominal position: this number of robust standard deviations plus this share of
# the pitch; otherwise the line is dirt or a digit.
OUTLIER_SIGMAS, OUTLIER_SHARE = 6.0, 0.02


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LineScaleFit(ShortRepr):
    """The calibration from a line scale, with the residuals of the lines.

    Parameters
    ----------
    calibration : Calibration
        The result.
    index : ndarray of int, shape (n,)
        Number of each line on the scale, counted from the first.
    used : ndarray of bool, shape (n,)
        Whether the line was used.
    residual_um : ndarray of float, shape (n,)
        Measured minus nominal position of each line (micrometres).
    by_edge : (float, float)
        Scale from the rising edges alone, and from the falling edges alone (px/mm).
    width_mm, u_width_mm : float or None
        Mean apparent width of the lines, and its standard uncertainty without that of the edge bias; None if the lines
        are too narrow.
    chi_square : float
        Chi-square of the residuals.
    freedom : int
        Degrees of freedom.
    probability : float
        Probability of a `chi_square` at least as large by chance.
    """

    calibration: Calibration
    index: NDArray[np.int_]
    used: NDArray[np.bool_]
    residual_um: Floats
    by_edge: tuple[float, float]
    width_mm: float | None
    u_width_mm: float | None
    chi_square: float
    freedom: int
    probability: float


def scale_from_lines(
    lines: ScaleLines,
    pitch_mm: float,
    u_line_mm: float,
    u_length_mm: float,
    frame_size_px: tuple[int, int],
    limits: Limits,
    reference: Reference,
    stated: frozenset[str] = frozenset(),
) -> LineScaleFit:
    """Fit the positions of all lines to integer multiples of the pitch.

    Parameters
    ----------
    lines : ScaleLines
        The measured lines.
    pitch_mm : float
        Certified distance of neighbouring lines.
    u_line_mm : float
        Standard uncertainty of each line's position, independent between lines.
    u_length_mm : float
        Standard uncertainty of the length between the first and the last line used, the same for all lines.
    frame_size_px : tuple of int
        Width and height of the picture.
    limits, stated
        Limits of the set-up's imperfections, and the names of those that the user stated.
    reference : Reference
        The scale's name and certificate; its size is filled in.

    Raises
    ------
    CalibrationError
        If the pitch or an uncertainty is not valid, or the lines are not equidistant.

    Examples
    --------
    >>> import numpy as np, calib
    >>> away = np.abs((np.arange(440.0) - 10.0) % 40.0 - 20.25)
    >>> away[:10] = away[410:] = 20.0
    >>> row = 220.0 - 180.0 * np.clip(5.5 - away, 0.0, 1.0)
    >>> lines = calib.find_lines(np.rint(np.tile(row, (120, 1))).astype(np.uint8))
    >>> reference = calib.Reference("stage micrometer", 1.0, 0.0, certificate="no. 17")
    >>> fit = calib.scale_from_lines(lines, 1.0, 0.0002, 0.0005, (440, 120), calib.Limits(), reference)
    >>> print(f"{fit.calibration.px_per_mm:.2f} px/mm")
    40.00 px/mm
    """
    _check(pitch_mm, u_line_mm, u_length_mm)
    index, used = _numbered(lines.at_px)
    at: Floats = lines.at_px[used]
    k: Floats = np.asarray(pitch_mm * index[used], dtype=np.float64)
    rough = float(np.ptp(at) / np.ptp(k))
    # The phase errors of a line's two edges are independent; the centre moves by half of their sum.
    estimator = rectangular(limits.estimator_px) / np.sqrt(2.0)
    u_edges: Floats = np.hypot(lines.u_at_px[used], estimator)
    u_places: Floats = np.hypot(u_edges, rough * u_line_mm)
    line = _straight_line(k, at, 1.0 / u_places**2)
    residual: Floats = np.asarray(lines.at_px - line.intercept - line.slope * pitch_mm * index, dtype=np.float64)
    bends = _bends(lines, used, frame_size_px, line.slope, limits)
    chi_square, freedom = _chi_square(residual[used], k, u_places, bends, limits)
    probability = float(chdtrc(freedom, chi_square)) if freedom > 0 else 1.0
    span_mm = float(np.ptp(k))
    parts = _budget(line, span_mm, u_line_mm, u_length_mm, u_edges, limits, stated)
    if probability < CHANCE:
        found = parts[1].covariance + parts[2].covariance
        parts.append(
            ScalePart("misfit of the lines", (chi_square / freedom - 1.0) * found, "the lines' residuals (Birge ratio)")
        )
    lens, *tilts = (np.array([float(line.gain @ bend), 0.0]) for bend in bends)
    calibration = Calibration(
        px_per_mm=line.slope,
        edge_bias_px=0.0,
        parts=tuple(parts),
        frame_size_px=frame_size_px,
        limits=limits,
        stated=stated,
        response=Response(lens=lens, tilt=np.array(tilts)),
        references=(Reference(reference.what, span_mm, u_length_mm, reference.certificate, reference.date),),
    )
    width = None if lines.width_px is None else lines.width_px[used] / line.slope
    return LineScaleFit(
        calibration=calibration,
        index=index,
        used=used,
        residual_um=1e3 * residual / line.slope,
        by_edge=(float(line.gain @ lines.rising_px[used]), float(line.gain @ lines.falling_px[used])),
        width_mm=None if width is None else float(np.mean(width)),
        u_width_mm=None if width is None else float(np.std(width, ddof=1) / np.sqrt(width.size)),
        chi_square=chi_square,
        freedom=freedom,
        probability=probability,
    )


def _check(pitch_mm: float, u_line_mm: float, u_length_mm: float) -> None:
    if not 0.0 < pitch_mm < float("inf"):
        raise CalibrationError(f"The pitch of a line scale must be positive, but is {pitch_mm} mm.")
    for name, value in (("u_line_mm", u_line_mm), ("u_length_mm", u_length_mm)):
        if not 0.0 <= value < float("inf"):
            raise CalibrationError(f"{name} must be a number of zero or more, but is {value}.")


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    """A weighted straight line.

    Parameters
    ----------
    slope, intercept : float
        Parameters of the line.
    gain : ndarray of float, shape (n,)
        Change of the slope per change of each ordinate.
    """

    slope: float
    intercept: float
    gain: Floats


def _straight_line(k: Floats, at: Floats, weight: Floats) -> _Line:
    centred = k - np.average(k, weights=weight)
    gain: Floats = np.asarray(weight * centred / np.sum(weight * centred**2), dtype=np.float64)
    slope = float(gain @ at)
    return _Line(slope, float(np.average(at, weights=weight) - slope * np.average(k, weights=weight)), gain)


def _bends(
    lines: ScaleLines, used: NDArray[np.bool_], frame_size_px: tuple[int, int], slope: float, limits: Limits
) -> tuple[Floats, ...]:
    """Shift of each line per unit of lens distortion, and per radian of tilt about each axis of the picture."""
    points = lines.middle_px[used]
    distance_px = limits.camera_distance_mm * slope
    lens = lens_shift_px(points, frame_size_px) @ lines.across
    return (lens, *(tilt_shift_px(points, frame_size_px, distance_px, axis) @ lines.across for axis in (0, 1)))


def _budget(
    line: _Line,
    span_mm: float,
    u_line_mm: float,
    u_length_mm: float,
    u_edges_px: Floats,
    limits: Limits,
    stated: frozenset[str],
) -> list[ScalePart]:
    """Uncertainty of the scale from the certificate, the single lines, the fit of their edges, and the edge bias."""
    size, one_line = line.slope * u_length_mm / span_mm, line.slope * u_line_mm * float(np.linalg.norm(line.gain))
    return [
        _part("reference size", size, "length of the scale, the certificate (--u-length-mm)"),
        _part("reference lines", one_line, "(--u-line-mm)"),
        _part("reference edges", float(np.linalg.norm(line.gain * u_edges_px)), "the fit of the lines"),
        ScalePart(
            "edge bias",
            np.diag([0.0, rectangular(limits.edge_bias_px) ** 2]),
            f"+-{limits.edge_bias_px:g} px ({'stated' if 'edge_bias_px' in stated else 'default'}); a pitch does not "
            "determine the edge bias, but a bar and a slot do",
        ),
    ]


def _part(source: str, u_scale: float, supplied: str) -> ScalePart:
    return ScalePart(source, np.diag([u_scale**2, 0.0]), supplied)


def _numbered(at_px: Floats) -> tuple[NDArray[np.int_], NDArray[np.bool_]]:
    """Number of each line on the scale, and whether it is near its nominal position."""
    steps = np.diff(at_px)
    pitch = float(np.median(steps))
    index = np.concatenate([[0], np.cumsum(np.maximum(np.rint(steps / pitch), 1.0))]).astype(np.int_)
    used = np.ones(at_px.size, dtype=bool)
    for look in range(5):
        if look == 0:
            # The first straight line is found by medians (Theil and Sen), which allow a third of the positions to be
            # wrong.
            apart = index[:, None] - index
            slope = float(np.median((at_px[:, None] - at_px)[apart > 0] / apart[apart > 0]))
            at = float(np.median(at_px - slope * index))
        else:
            slope, at = (float(value) for value in np.polyfit(index[used], at_px[used], 1))
        # Numbers follow from the pitch of the whole scale, because errors of single steps would accumulate.
        index = np.rint((at_px - at) / slope).astype(np.int_)
        left = at_px - at - slope * index
        spread = 1.4826 * float(np.median(np.abs(left[used])))
        again = np.abs(left) <= OUTLIER_SIGMAS * spread + OUTLIER_SHARE * slope
        if np.count_nonzero(again) < 3:
            break
        if look and np.array_equal(again, used):
            break
        used = again
    if np.count_nonzero(used) < max(3, 0.7 * at_px.size) or len(set(index[used].tolist())) < np.count_nonzero(used):
        raise CalibrationError(
            f"The lines of a scale must be equidistant, but {np.count_nonzero(~used)} of {at_px.size} are not: select "
            "lines of one kind with --roi."
        )
    return index - index[used].min(), used


def _chi_square(residual: Floats, k: Floats, u: Floats, bends: tuple[Floats, ...], limits: Limits) -> tuple[float, int]:
    """Chi-square of the residuals, with lens distortion and tilt fitted within their limits."""
    covariance = np.diag(u**2) + np.outer(bends[0], bends[0]) * rectangular(limits.lens_relative) ** 2
    for bend in bends[1:]:
        covariance += np.outer(bend, bend) * rectangular(limits.tilt_rad) ** 2
    inverse = np.linalg.inv(covariance)
    design = np.stack([np.ones_like(k), k], axis=1)
    refit = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse @ residual)
    left = residual - design @ refit
    return float(left @ inverse @ left), residual.size - 2
