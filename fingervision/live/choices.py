"""Settings of a live view that the user may change while the view runs."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from calib.calibration import is_stated
from calib.measured_scale import Calibration
from fingervision.domain.direction import Direction
from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Region
from fingervision.frames.source import Description
from fingervision.measuring.scale import Scale, scale_for_frames
from fingervision.measuring.task import Task

MOVES_ZERO = frozenset({"scale", "below_tip_mm", "direction", "region", "fingers"})
"""Settings whose change invalidates the zero."""
ZERO_IS_OFF = "The zero was removed, because it was set with another scale, height, region or direction of the tips."


@dataclass(frozen=True, slots=True)
class Choices:
    """Settings of a live view: scale, height, direction and region of the measurement, zero and tolerance shown.

    Parameters
    ----------
    scale : Scale or None
        Scale of the picture; None until the user states it: the picture is then shown without a measurement.
    scale_file : Path or None
        Calibration file from which the scale was read.
    below_tip_mm : float
        Measuring height: distance below the finger tips.
    direction : Direction or None
        Direction in which the tips point; None for automatic detection.
    region : Region or None
        Region of interest; None for the complete frame.
    fingers : str
        Brightness of the fingers (`measuring.task.FINGERS`): auto for automatic detection, none if no gap is asked for.
    zero_mm : float
        Value subtracted from the displayed gap; files contain the gap without this subtraction.
    least_mm, greatest_mm : float or None
        Lower and upper tolerance limit of the gap; None without a limit.
    """

    scale: Scale | None = None
    scale_file: Path | None = None
    below_tip_mm: float = 0.3
    direction: Direction | None = None
    region: Region | None = None
    fingers: str = "auto"
    zero_mm: float = 0.0
    least_mm: float | None = None
    greatest_mm: float | None = None

    def changed(self, **changes: Any) -> tuple["Choices", bool]:
        """Return changed settings, and whether the change removed the zero.

        The zero is a gap measured with a certain scale, height, direction and region. A change of scale, height,
        direction or region invalidates and removes the zero.
        """
        moves_zero = bool(MOVES_ZERO & set(changes))
        if self.zero_mm and moves_zero:
            changes.setdefault("zero_mm", 0.0)
        chosen = replace(self, **changes)
        return chosen, bool(self.zero_mm) and chosen.zero_mm == 0.0 and moves_zero

    @property
    def task(self) -> Task | None:
        """Return the settings of the measurement; None until the scale is known."""
        if self.scale is None:
            return None
        return Task(
            self.scale,
            self.scale_file,
            self.below_tip_mm,
            self.direction,
            self.region,
            fingers=self.fingers,
        )

    def for_frames(self, description: Description) -> "Choices":
        """Refuse settings that are impossible for frames of this size; complete the scale by the frames' size.

        Raises
        ------
        UsageError
            The region lies outside the frame, the height is not positive, or the lower limit is not below the upper
            limit.
        DataError
            The scale is for other frames.
        """
        width_px, height_px = description.width_px, description.height_px
        if not 0.0 < self.below_tip_mm < float("inf"):
            raise UsageError(f"--below-tip-mm must be positive, but is {self.below_tip_mm:g}.")
        box = self.region
        if box is not None and not (
            min(box.x_px, box.y_px) >= 0
            and min(box.width_px, box.height_px) > 0
            and box.x_px + box.width_px <= width_px
            and box.y_px + box.height_px <= height_px
        ):
            raise UsageError(
                f"The region must lie inside the frame of {width_px}x{height_px} pixels, but is "
                f"{box.x_px},{box.y_px},{box.width_px},{box.height_px} (first column, row, width, height)."
            )
        scale = None if self.scale is None else scale_for_frames(self.scale, (width_px, height_px))
        limits = (self.least_mm, self.greatest_mm)
        if None not in limits and self.least_mm >= self.greatest_mm:  # type: ignore[operator]
            raise UsageError(
                f"The lower limit must be below the upper limit, but the limits are {self.least_mm:g} and "
                f"{self.greatest_mm:g} mm."
            )
        return replace(self, scale=scale)

    def verdict(self, gap_mm: float | None, u_mm: float | None) -> str:
        """State whether a gap is within the limits, taking its uncertainty into account (ISO 14253-1).

        Parameters
        ----------
        gap_mm, u_mm : float or None
            The gap and its standard uncertainty; the guard bands at the limits are the expanded uncertainty (k = 2).

        Returns
        -------
        str
            "pass", "fail", "unsure" (near a limit), or "" (without limits or gap).
        """
        if gap_mm is None or (self.least_mm is None and self.greatest_mm is None):
            return ""
        guard_mm = 2.0 * (u_mm or 0.0)
        low = -float("inf") if self.least_mm is None else self.least_mm
        high = float("inf") if self.greatest_mm is None else self.greatest_mm
        if gap_mm + guard_mm < low or gap_mm - guard_mm > high:
            return "fail"
        return "pass" if low <= gap_mm - guard_mm and gap_mm + guard_mm <= high else "unsure"

    def settings(self) -> dict[str, Any]:
        """Return the settings of the measurement as a settings file states them; None for what is not stated."""
        region, bare = self.region, self.scale if self.scale_file is None else None
        return {
            "calibration": self.scale_file,
            "px_per_mm": None if bare is None else bare.px_per_mm,
            "u_px_per_mm": bare.u_px_per_mm if isinstance(bare, Calibration) and is_stated(bare) else None,
            "below_tip_mm": self.below_tip_mm,
            "tips": "auto" if self.direction is None else self.direction.value,
            "fingers": self.fingers,
            "roi": None if region is None else [region.x_px, region.y_px, region.width_px, region.height_px],
        }

    def state(self) -> dict[str, Any]:
        """Return scale, region, height, zero and tolerance, for the browser page."""
        scale, region = self.scale, self.region
        return {
            "zero_mm": self.zero_mm,
            "px_per_mm": None if scale is None else scale.px_per_mm,
            "u_px_per_mm": scale.u_px_per_mm if isinstance(scale, Calibration) else None,
            "region": None if region is None else [region.x_px, region.y_px, region.width_px, region.height_px],
            "tips": "auto" if self.direction is None else self.direction.value,
            "fingers": self.fingers,
            "below_tip_mm": self.below_tip_mm,
            "least_mm": self.least_mm,
            "greatest_mm": self.greatest_mm,
        }
