"""A scale with its standard uncertainty as stated by the user, such as from a ruler or a data sheet."""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from calib.calibration import BareScale
from calib.limits import Limits, rectangular
from calib.measured_scale import Calibration, ScalePart

STATED = "scale, as stated"
"""Name of the stated uncertainty's line in a budget."""


@dataclass(frozen=True, slots=True)
class StatedScale(BareScale):
    """A scale stated by the user together with its standard uncertainty.

    Until the size of the frames is known, the object serves as a scale without uncertainty; `for_frames` then gives the
    calibration by which distances get their full uncertainty.

    Parameters
    ----------
    px_per_mm : float
        Pixels per millimetre; positive.
    u_px_per_mm : float
        Standard uncertainty of `px_per_mm`; positive and smaller than `px_per_mm`.

    Raises
    ------
    ValueError
        If the scale or its uncertainty is impossible.
    """

    u_px_per_mm: float

    def __post_init__(self) -> None:
        """Refuse an impossible scale or uncertainty."""
        # `super()` without arguments fails here, because a dataclass with slots is a new class.
        BareScale.__post_init__(self)
        if not (isfinite(self.u_px_per_mm) and 0.0 < self.u_px_per_mm < self.px_per_mm):
            raise ValueError(
                f"u_px_per_mm must be positive and smaller than px_per_mm ({self.px_per_mm:g}), "
                f"but is {self.u_px_per_mm:g}."
            )

    def for_frames(self, frame_size_px: tuple[int, int]) -> Calibration:
        """Return the calibration that corresponds to the stated values.

        The stated uncertainty is one contribution to the calibration's budget. As with a single reference object, the
        edge bias is unknown, and the set-up's imperfections have their default limits (`calib.limits.Limits`).

        Parameters
        ----------
        frame_size_px : (int, int)
            Width and height of the frames to be measured.
        """
        limits = Limits()
        parts = (
            ScalePart(STATED, np.diag([self.u_px_per_mm**2, 0.0]), "(--u-px-per-mm)"),
            ScalePart(
                "edge bias",
                np.diag([0.0, rectangular(limits.edge_bias_px) ** 2]),
                f"+-{limits.edge_bias_px:g} px (default); a stated scale does not determine the edge bias, but a bar "
                "and a slot do",
            ),
        )
        # The scale was not measured on edges in a picture, so that it has no error of the camera response in common
        # with the recording.
        return Calibration(self.px_per_mm, 0.0, parts, frame_size_px, limits, response_shift_px=0.0)


def is_stated(scale: object) -> bool:
    """Whether a scale was stated by the user instead of measured on a reference object."""
    if isinstance(scale, Calibration):
        return any(part.source == STATED for part in scale.parts)
    return isinstance(scale, BareScale)
