"""Uncertainty budget of a distance: one function for each source, and the only place that combines the sources.

A source's function returns its standard uncertainty in millimetres, shape (n,), for n distances. The formula is
gap_mm = (gap_px + p b) / s, where gap_px is the measured width, s the scale, b the edge bias, and p = +1 for a light
gap and -1 for a dark gap (JCGM 100:2008, equation 13).
"""

from dataclasses import dataclass
from math import cos, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from calib.limits import Limits, rectangular
from calib.picture_shift import change_of_distance_px, lens_shift_px, tilt_shift_px
from calib.short_repr import ShortRepr

if TYPE_CHECKING:
    from calib.measured_scale import Calibration


Floats = NDArray[np.float64]


def edge_noise_mm(u_random_px: Floats, px_per_mm: float) -> Floats:
    """Contribution of the noise of the two edges, the only contribution that differs from frame to frame."""
    return np.asarray(u_random_px / px_per_mm)


def estimator_mm(limits: Limits, px_per_mm: float, count: int) -> Floats:
    """Contribution of the edge fit's phase error, for two independent edges."""
    return np.full(count, sqrt(2.0) * rectangular(limits.estimator_px) / px_per_mm)


def scale_and_bias_mm(value_mm: Floats, polarity: Floats, px_per_mm: float, covariance: Floats) -> Floats:
    """Contribution of one cause that changes scale and edge bias, from the covariance of (px_per_mm, edge_bias_px).

    The function is called once for each cause: the reference's size, the reference's edges, and the edge bias if no
    reference determines it.
    """
    variance = (
        covariance[1, 1] + value_mm**2 * covariance[0, 0] - 2.0 * polarity * value_mm * covariance[0, 1]
    ) / px_per_mm**2
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def plane_mm(value_mm: Floats, limits: Limits) -> Floats:
    """Contribution of a plane that is not at the distance Z of the reference from the camera: dg / g = dz / Z."""
    return np.asarray(np.abs(value_mm) * rectangular(limits.plane_mm) / limits.camera_distance_mm)


def foreshortening_mm(value_mm: Floats, limits: Limits) -> Floats:
    """Contribution of oblique view: a distance is shortened by the factor cos(tilt)."""
    return np.asarray(np.abs(value_mm) * rectangular(1.0 - cos(limits.tilt_rad)))


def keystone_mm(change_mm_per_rad: Floats, limits: Limits) -> Floats:
    """Contribution of the perspective of a tilted plane; `change_mm_per_rad` has shape (2, n), one row per axis."""
    return np.asarray(np.hypot(change_mm_per_rad[0], change_mm_per_rad[1]) * rectangular(limits.tilt_rad))


def lens_mm(change_mm_per_unit: Floats, limits: Limits) -> Floats:
    """Contribution of residual lens distortion, from the change per unit of distortion of distance minus scale."""
    return np.asarray(np.abs(change_mm_per_unit) * rectangular(limits.lens_relative))


def lens_fit_mm(change_px: Floats, covariance: Floats, px_per_mm: float) -> Floats:
    """Contribution of a calibrated lens, from `change_px` per unit of each parameter, shape (p, n), and covariance."""
    variance = np.einsum("in,ij,jn->n", change_px, covariance, change_px)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)) / px_per_mm)


def temperature_mm(value_mm: Floats, limits: Limits) -> Floats:
    """Contribution of thermal expansion of the reference relative to the temperature of its certificate."""
    return np.asarray(np.abs(value_mm) * limits.expansion_per_k * rectangular(limits.temperature_k))


# Step for the numerical derivative of a distance by a lens parameter, as a share of the parameter's standard
# uncertainty.
LENS_STEP = 0.1


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BudgetLine(ShortRepr):
    """One source of uncertainty, with its contribution to n distances.

    Parameters
    ----------
    source : str
        Name of the source.
    u_mm : ndarray, shape (n,)
        Standard uncertainty of each distance from this source alone.
    supplied : str
        Value or option that the user must supply for this contribution, and the value that was used.
    shared : bool
        True if all frames have the same error; False if it differs from frame to frame.
    """

    source: str
    u_mm: Floats
    supplied: str
    shared: bool = True


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Budget(ShortRepr):
    """All sources of uncertainty of n distances.

    Examples
    --------
    >>> import numpy as np, calib
    >>> scale = calib.StatedScale(34.0, 0.1).for_frames((640, 480))
    >>> ends_px = np.array([[[100.0, 150.0], [300.0, 150.0]]])
    >>> budget = scale.budget(ends_px, np.array([0.02]), np.array([True]))
    >>> budget
    Budget(lines=9 items)
    >>> print(f"u = {1000.0 * budget.u_mm[0]:.0f} um")
    u = 28 um
    """

    lines: tuple[BudgetLine, ...]

    @property
    def u_mm(self) -> Floats:
        """Combined standard uncertainty (mm): root of the sum of squares (JCGM 100:2008, equation 10)."""
        return self._combined(self.lines)

    @property
    def u_random_mm(self) -> Floats:
        """Combined standard uncertainty of the sources that differ from frame to frame (mm)."""
        return self._combined(tuple(line for line in self.lines if not line.shared))

    @staticmethod
    def _combined(lines: tuple[BudgetLine, ...]) -> Floats:
        return np.asarray(np.sqrt(np.sum([line.u_mm**2 for line in lines], axis=0)))

    def table(self) -> str:
        """Contributions of the first distance as a table, the largest first, in micrometres."""
        ordered = sorted(self.lines, key=lambda line: -float(line.u_mm[0]))
        width = max(len(line.source) for line in ordered)
        rows = [f"{'source':<{width}}  u, um   kind    from"]
        for line in ordered:
            kind = "shared" if line.shared else "random"
            rows.append(f"{line.source:<{width}}  {1e3 * line.u_mm[0]:6.3f}  {kind}  {line.supplied}")
        total_um = 1e3 * float(self.u_mm[0])
        rows.append(f"{'combined':<{width}}  {total_um:6.3f}          U = {2 * total_um:.3f} um (k = 2)")
        return "\n".join(rows)


def distance_budget(
    scale: "Calibration", points_px: Floats, flat_px: Floats, value_mm: Floats, u_random_px: Floats, polarity: Floats
) -> Budget:
    """Compute every contribution to n distances.

    Parameters
    ----------
    scale : Calibration
        The calibration and the limits that it states.
    points_px, flat_px : ndarray, shape (n, 2, 2)
        The measured points, and the same points corrected for lens distortion and perspective.
    value_mm : ndarray, shape (n,)
        The distances.
    u_random_px : ndarray, shape (n,)
        Random standard uncertainty of each distance, in pixels of `flat_px`.
    polarity : ndarray, shape (n,)
        +1 for a light gap, -1 for a dark gap; nearer to zero where the edge bias displaces the points by less.
    """
    limits, s = scale.limits, scale.px_per_mm
    said = scale.how_stated
    lines = [
        BudgetLine("edge noise", edge_noise_mm(u_random_px, s), "the fit of each frame's edges", shared=False),
        BudgetLine("estimator", estimator_mm(limits, s, len(value_mm)), said("estimator_px", "px an edge")),
    ]
    for part in scale.parts:
        u_mm = scale_and_bias_mm(value_mm, polarity, s, part.covariance)
        lines.append(BudgetLine(part.source, u_mm, part.supplied))
    plane_words = f"{said('plane_mm', 'mm')}, camera {said('camera_distance_mm', 'mm away').removeprefix('+-')}"
    lines += [
        BudgetLine("distance from the calibrated plane", plane_mm(value_mm, limits), plane_words),
        BudgetLine("tilt: foreshortening", foreshortening_mm(value_mm, limits), said("tilt_deg", "degrees")),
        BudgetLine(
            "tilt: perspective",
            keystone_mm(_keystone_change(scale, flat_px, value_mm, polarity), limits),
            said("tilt_deg", "degrees"),
        ),
        BudgetLine(
            "lens residual",
            lens_mm(_lens_change(scale, flat_px, value_mm, polarity), limits),
            said("lens_relative", "of the radius at the corner"),
        ),
        BudgetLine("temperature", temperature_mm(value_mm, limits), said("temperature_k", "K")),
    ]
    if scale.lens is not None:
        u_mm = lens_fit_mm(_lens_fit_change_px(scale, points_px), scale.lens.covariance, s)
        lines.append(BudgetLine("lens calibration", u_mm, "the fit of the board's corners"))
    return Budget(tuple(lines))


def _through_scale(scale: "Calibration", change_px: Floats, of_scale: Floats, value_mm: Floats, sign: Floats) -> Floats:
    # The same imperfection has displaced the edges of the reference, and so changed scale and edge bias; the two
    # changes partly cancel.
    return np.asarray((change_px + sign * of_scale[1] - value_mm * of_scale[0]) / scale.px_per_mm)


def _lens_change(scale: "Calibration", flat_px: Floats, value_mm: Floats, polarity: Floats) -> Floats:
    change = change_of_distance_px(flat_px, lens_shift_px(flat_px, scale.frame_size_px))
    return _through_scale(scale, change, scale.response.lens, value_mm, polarity)


def _keystone_change(scale: "Calibration", flat_px: Floats, value_mm: Floats, polarity: Floats) -> Floats:
    distance_px = scale.limits.camera_distance_mm * scale.px_per_mm
    changes = []
    for axis in (0, 1):
        shift = tilt_shift_px(flat_px, scale.frame_size_px, distance_px, axis)
        change = change_of_distance_px(flat_px, shift)
        changes.append(_through_scale(scale, change, scale.response.tilt[axis], value_mm, polarity))
    return np.array(changes)


def _lens_fit_change_px(scale: "Calibration", points_px: Floats) -> Floats:
    assert scale.lens is not None  # noqa: S101 - the caller asks only where there is a lens
    lens = scale.lens
    middle = np.linalg.norm(np.diff(scale.flatten(points_px), axis=1)[:, 0], axis=1)
    changes = np.zeros((len(lens.parameters), len(points_px)))
    for index, u in enumerate(np.sqrt(np.diag(lens.covariance))):
        if u > 0.0:
            moved = scale.flatten_by(lens.moved(index, LENS_STEP * u), points_px)
            changes[index] = (np.linalg.norm(moved[:, 1] - moved[:, 0], axis=1) - middle) / (LENS_STEP * u)
    return changes
