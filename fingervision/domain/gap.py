"""What is measured of the gap between two fingers in one frame."""

from dataclasses import dataclass, replace
from math import hypot

from fingervision.domain.direction import Direction
from fingervision.domain.status import Status


@dataclass(frozen=True, slots=True)
class FingerEdge:
    """The inner edge of one finger at the measuring height, and the finger's tip, from which that height is counted.

    Pixel coordinates: x right, y down, the centre of the full frame's first pixel is (0, 0).

    Parameters
    ----------
    x_px, y_px : float
        The measuring point.
    tip_px : float
        The tip's coordinate along the fingers' axis (y for tips up or down, x for tips left or right).
    u_across_px : float
        Standard uncertainty of the measuring point across the fingers, the tip's share included.
    u_tip_px : float
        Standard uncertainty of the tip along the fingers' axis.
    slope : float
        How far the edge moves across per pixel towards the root, at the measuring point.
    blur_px : float
        Standard deviation sigma_e of the edge's Gaussian spread, the pixel's own width included.
    contrast : float
        Grey levels between the two plateaus, on the frame's own scale.
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
    """A part that both fingers hold: positions of their inner edges half-way along the part.

    Parameters
    ----------
    left_x_px, left_y_px, right_x_px, right_y_px : float
        The two places, at the same height along the fingers.
    u_width_px : float
        Standard uncertainty of the width from frame to frame.
    light_gap : bool
        True for dark fingers on a light ground; False for light fingers on a dark one.
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
        Where the tips point.
    u_gap_px : float
        Standard uncertainty of `gap_px` from frame to frame.
    light_gap : bool
        True for dark fingers on a light ground; False for light fingers on a dark one.
    u_shift_px : float
        Standard uncertainty of `gap_px` for what may have moved the edges in every frame alike: a bright rim, light
        just beyond the end of the scale, or what all rows of an edge share of their residuals although nobody says that
        the picture was compressed. Zero where the edges show none of these.
    response_shift_px : float
        How much larger `gap_px` is than it would be if the other camera response that is possible were the true one;
        zero where the response is known.
    roughness_px : float
        Standard deviation of the edges about their mean line where they are rough or printed with a texture; zero where
        they stray no more than their noise. What is measured is the mean line; a contact is made by the crests.
    fields_apart_px : float
        How far apart even and odd rows see the faster finger; zero where they agree. The gap is that of the middle.
    beside : str
        What stands beside the edges or has moved them: wall, shadow, glare, motion, sharpening; empty where nothing is
        seen.
    held : HeldPart or None
        The part that is held, where one is seen.
    u_coding_px : float
        As much of `u_gap_px` (in quadrature) is what the codec may have done to each edge as a whole; zero where its
        quantiser is not known.
    """

    left: FingerEdge
    right: FingerEdge
    direction: Direction
    u_gap_px: float
    light_gap: bool
    u_shift_px: float = 0.0
    response_shift_px: float = 0.0
    roughness_px: float = 0.0
    fields_apart_px: float = 0.0
    beside: str = ""
    held: HeldPart | None = None
    u_coding_px: float = 0.0

    @property
    def u_picture_px(self) -> float:
        """Standard uncertainty of `gap_px` from this picture alone, the same in every frame (pixels).

        It combines the systematic part of the edges with the camera's unknown response.

        Of the response: the true gap lies between its values for the assumed and for the alternative response, a
        rectangular distribution with the measured value at one end (after JCGM 100:2008, 4.3.7, which has the value in
        the middle).
        """
        return hypot(self.u_shift_px, self.response_shift_px / 3.0**0.5)

    @property
    def status(self) -> Status:
        """A measurement is always `Status.OK`."""
        return Status.OK

    @property
    def gap_px(self) -> float:
        """Distance between the two measuring points; slanted where the tips are at different heights."""
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
        The reason, as it stands in the table.
    words : str
        The reason in a sentence.
    held : HeldPart or None
        The part that hides the inner edges, where its width is known all the same.
    """

    status: Status
    words: str
    held: HeldPart | None = None

    def shifted(self, x_px: float, y_px: float) -> "NoGap":
        """Return the frame's state with the coordinates of a held part, if any, shifted by x_px and y_px."""
        return self if self.held is None else replace(self, held=self.held.shifted(x_px, y_px))
