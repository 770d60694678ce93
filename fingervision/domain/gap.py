"""Measurement of the gap between two fingers in one video frame."""

from dataclasses import dataclass, replace
from math import hypot

from fingervision.domain.direction import Direction
from fingervision.domain.status import Status


@dataclass(frozen=True, slots=True)
class FingerEdge:
    """The inner edge of one finger at the measuring height, and the finger's tip, from which this height is measured.

    Pixel coordinates: x right, y down, the centre of the full frame's first pixel is (0, 0).

    Parameters
    ----------
    x_px, y_px : float
        Coordinates of the measuring point.
    tip_px : float
        The tip's coordinate along the fingers' axis (y for tips up or down, x for tips left or right).
    u_across_px : float
        Standard uncertainty of the measuring point across the fingers, including the contribution of the tip.
    u_tip_px : float
        Standard uncertainty of the tip along the fingers' axis.
    slope : float
        Slope of the edge at the measuring point: displacement across the fingers per pixel towards the finger's root.
    blur_px : float
        Standard deviation sigma_e of the edge's Gaussian blur, including the width of the pixel.
    contrast : float
        Difference between the grey levels on the two sides of the edge, in grey levels of the frame.
    """

    x_px: float
    y_px: float
    tip_px: float
    u_across_px: float
    u_tip_px: float
    slope: float
    blur_px: float
    contrast: float


@dataclass(frozen=True, slots=True)
class HeldPart:
    """A part that both fingers hold: positions of the fingers' inner edges at half the length of the part.

    Parameters
    ----------
    left_x_px, left_y_px, right_x_px, right_y_px : float
        Positions of the two inner edges, at the same height along the fingers.
    u_width_px : float
        Random standard uncertainty of the width (from frame to frame).
    light_gap : bool
        True for dark fingers on a light background; False for light fingers on a dark background.
    """

    left_x_px: float
    left_y_px: float
    right_x_px: float
    right_y_px: float
    u_width_px: float
    light_gap: bool

    @property
    def width_px(self) -> float:
        """Distance between the fingers' inner edges where they touch the held part, across the fingers (pixels)."""
        return hypot(self.right_x_px - self.left_x_px, self.right_y_px - self.left_y_px)

    def shifted(self, x_px: float, y_px: float) -> "HeldPart":
        """Return the part with x_px and y_px added to its coordinates, as after cropping the picture."""
        return replace(
            self,
            left_x_px=self.left_x_px + x_px,
            left_y_px=self.left_y_px + y_px,
            right_x_px=self.right_x_px + x_px,
            right_y_px=self.right_y_px + y_px,
        )


@dataclass(frozen=True, slots=True)
class GapMeasurement:
    """The two measuring points of one frame and the distance between them.

    Parameters
    ----------
    left, right : FingerEdge
        `left` is the finger with the smaller coordinate across the fingers.
    direction : Direction
        Direction in which the tips point.
    u_gap_px : float
        Random standard uncertainty of `gap_px` (from frame to frame).
    light_gap : bool
        True for dark fingers on a light background; False for light fingers on a dark background.
    u_shift_px : float
        Standard uncertainty of `gap_px` from causes that may have displaced the edges equally in every frame: a bright
        rim, slight overexposure, or residuals that all rows of an edge share although the picture is not declared as
        compressed. Zero if the edges show none of these.
    u_response_px : float
        Standard uncertainty of `gap_px` due to the camera's response, with the sign of the probable error; zero if the
        response is known.
    roughness_px : float
        Standard deviation of rough or textured edges about their mean lines; zero if the deviations do not exceed the
        noise. The gap is measured between the mean lines, whereas the crests make contact.
    fields_apart_px : float
        Displacement of the faster finger between even and odd rows of an interlaced picture; zero if both sets of rows
        agree. The gap is the mean of both.
    beside : str
        Disturbance beside the edges, or which has displaced the edges: wall, shadow, glare (two of these are joined by
        "and"), motion, trail, sharpening;
        empty if none was found.
    is_unlike : bool
        Whether the edges show other things beside them than the frames from which the recording's camera was learnt.
    held : HeldPart or None
        The part that the fingers hold; None if no part was found.
    u_coding_px : float
        Contribution (in quadrature) to `u_gap_px` from displacements of a whole edge by the codec; zero if the
        quantiser of the codec is not known.
    """

    left: FingerEdge
    right: FingerEdge
    direction: Direction
    u_gap_px: float
    light_gap: bool
    u_shift_px: float = 0.0
    u_response_px: float = 0.0
    roughness_px: float = 0.0
    fields_apart_px: float = 0.0
    beside: str = ""
    is_unlike: bool = False
    held: HeldPart | None = None
    u_coding_px: float = 0.0

    @property
    def u_picture_px(self) -> float:
        """Standard uncertainty of `gap_px` from this picture alone, the same in every frame (pixels).

        The value combines the systematic uncertainty of the edges with that of the camera's response.
        """
        return hypot(self.u_shift_px, self.u_response_px)

    @property
    def status(self) -> Status:
        """Status of a measurement, which is always `Status.OK`."""
        return Status.OK

    @property
    def gap_px(self) -> float:
        """Distance between the two measuring points (pixels); the line is inclined if the tips differ in height."""
        return hypot(self.right.x_px - self.left.x_px, self.right.y_px - self.left.y_px)

    def shifted(self, x_px: float, y_px: float) -> "GapMeasurement":
        """Return the measurement with x_px and y_px added to its coordinates, as after cropping the picture."""
        along_px = y_px if self.direction.is_vertical else x_px
        left, right = (
            replace(edge, x_px=edge.x_px + x_px, y_px=edge.y_px + y_px, tip_px=edge.tip_px + along_px)
            for edge in (self.left, self.right)
        )
        return replace(self, left=left, right=right, held=self.held and self.held.shifted(x_px, y_px))


@dataclass(frozen=True, slots=True)
class NoGap:
    """A frame without a gap value, with the reason.

    Parameters
    ----------
    status : Status
        The reason, as written in the column `status` of the table.
    words : str
        The reason in a sentence.
    held : HeldPart or None
        The part that hides the inner edges, if the width of the part could still be measured.
    """

    status: Status
    words: str
    held: HeldPart | None = None

    def shifted(self, x_px: float, y_px: float) -> "NoGap":
        """Return a copy in which the coordinates of a held part, if any, are shifted by x_px and y_px."""
        return self if self.held is None else replace(self, held=self.held.shifted(x_px, y_px))
