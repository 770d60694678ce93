"""Draw the result of a measurement into a video frame."""

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame, Pixels
from fingervision.domain.gap import FingerEdge, GapMeasurement, NoGap
from fingervision.vision.edges import EdgePoints
from fingervision.vision.fingers import CoarseFingers
from fingervision.vision.grey import top_level
from fingervision.vision.orientation import Orientation
from fingervision.vision.profile_lines import IS_ROW

# Colours (red, green, blue) of the parts of the drawing.
EDGE, TIP, POINT, DISTANCE, HELD, WORDS, FAILURE, BACKING = (
    (64, 200, 255),
    (255, 176, 32),
    (255, 64, 64),
    (64, 255, 96),
    (255, 96, 255),
    (255, 255, 255),
    (255, 96, 96),
    (0, 0, 0),
)
# OpenCV draws sub-pixel positions as multiples of 1/16 px.
FRACTION_BITS = 4
# Height of a frame for which lines are one pixel wide; line width and text size are proportional to the height.
USUAL_HEIGHT_PX = 480.0
EDGE_LENGTH_PX, TIP_LENGTH_PX, POINT_PX = 30.0, 26.0, 6.0

Canvas = NDArray[np.uint8]


def draw_overlay(frame: Frame, outcome: GapMeasurement | NoGap, words: str) -> Canvas:
    """Draw edges, tips, measuring points and their distance, the width of a held part, and a line of text.

    Parameters
    ----------
    frame : Frame
        The picture that was measured.
    outcome : GapMeasurement or NoGap
        Result of the measurement.
    words : str
        Text with the value, or with the reason why there is none; empty for no text.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        The picture with the drawing, in red, green and blue.
    """
    canvas = _as_colour(frame)
    size = max(0.4, min(frame.height_px, frame.width_px) / USUAL_HEIGHT_PX)
    if isinstance(outcome, GapMeasurement):
        for edge in (outcome.left, outcome.right):
            _draw_finger(canvas, edge, outcome.direction, size)
        left, right = outcome.left, outcome.right
        _line(canvas, (left.x_px, left.y_px), (right.x_px, right.y_px), DISTANCE, size)
        for edge in (left, right):
            _cross(canvas, edge.x_px, edge.y_px, POINT_PX * size, size)
    if outcome.held is not None:
        held = outcome.held
        _line(canvas, (held.left_x_px, held.left_y_px), (held.right_x_px, held.right_y_px), HELD, size)
    if words:
        _write(canvas, words, WORDS if isinstance(outcome, GapMeasurement) else FAILURE, size)
    return canvas


def draw_boundary(frame: Frame, fingers: CoarseFingers | None) -> Canvas:
    """Draw the outlines of the two fingers from the binary picture; draw nothing if no fingers were found."""
    canvas = _as_colour(frame)
    if fingers is None:
        return canvas
    for finger in (fingers.left, fingers.right):
        _polyline(canvas, finger.outline.astype(np.float64), fingers.orientation)
    return canvas


def draw_edge_points(frame: Frame, fingers: CoarseFingers | None, edges: EdgePoints | None) -> Canvas:
    """Draw every sub-pixel edge point as a dot; draw nothing if no edges were measured."""
    canvas = _as_colour(frame)
    if fingers is None or edges is None:
        return canvas
    lines = edges.lines
    across, along = np.where(IS_ROW, edges.position, lines.fixed), np.where(IS_ROW, lines.fixed, edges.position)
    fraction = 1 << FRACTION_BITS
    for a, r in zip(across[lines.weight > 0], along[lines.weight > 0], strict=True):
        x, y = fingers.orientation.to_pixels(float(a), float(r))
        cv2.circle(canvas, (round(x * fraction), round(y * fraction)), fraction, EDGE, -1, cv2.LINE_AA, FRACTION_BITS)
    return canvas


def in_eight_bits(grey: Pixels) -> Canvas:
    """Convert grey levels to eight bits for display."""
    if grey.dtype != np.uint16:
        return np.ascontiguousarray(grey)
    return np.ascontiguousarray((grey >> (top_level(grey).bit_length() - 8)).astype(np.uint8))


def _polyline(canvas: Canvas, outline: NDArray[np.float64], orientation: Orientation) -> None:
    points = [orientation.to_pixels(float(a), float(r)) for a, r in outline]
    cv2.polylines(canvas, [np.rint(points).astype(np.int32)], False, EDGE, 1, cv2.LINE_AA)


def _as_colour(frame: Frame) -> Canvas:
    """Copy a video frame as an eight-bit colour picture."""
    pixels = frame.pixels
    levels = in_eight_bits(pixels)
    if levels.ndim == 3:
        return np.array(levels, dtype=np.uint8)
    return cv2.cvtColor(np.ascontiguousarray(levels), cv2.COLOR_GRAY2RGB)  # type: ignore[return-value]


def _draw_finger(canvas: Canvas, edge: FingerEdge, direction: Direction, size: float) -> None:
    """Draw the edge's tangent at the measuring point, and a line across the finger at its tip."""
    root = 1.0 if direction in (Direction.UP, Direction.LEFT) else -1.0
    steepness = float(np.hypot(1.0, edge.slope))
    along, across = EDGE_LENGTH_PX * size / steepness * root, EDGE_LENGTH_PX * size / steepness * edge.slope
    vertical = direction.is_vertical
    step = (across, along) if vertical else (along, across)
    half_step = (0.5 * step[0], 0.5 * step[1])
    start = (edge.x_px - half_step[0], edge.y_px - half_step[1])
    _line(canvas, start, (edge.x_px + half_step[0], edge.y_px + half_step[1]), EDGE, size)
    half = TIP_LENGTH_PX * size
    if vertical:
        _line(canvas, (edge.x_px - half, edge.tip_px), (edge.x_px + half, edge.tip_px), TIP, size)
    else:
        _line(canvas, (edge.tip_px, edge.y_px - half), (edge.tip_px, edge.y_px + half), TIP, size)


def _cross(canvas: Canvas, x_px: float, y_px: float, half: float, size: float) -> None:
    _line(canvas, (x_px - half, y_px), (x_px + half, y_px), POINT, size)
    _line(canvas, (x_px, y_px - half), (x_px, y_px + half), POINT, size)


def _line(
    canvas: Canvas, start: tuple[float, float], end: tuple[float, float], colour: tuple[int, int, int], size: float
) -> None:
    fraction = 1 << FRACTION_BITS
    first, last = ((round(x * fraction), round(y * fraction)) for x, y in (start, end))
    cv2.line(canvas, first, last, colour, max(1, round(size)), cv2.LINE_AA, FRACTION_BITS)


def _write(canvas: Canvas, words: str, colour: tuple[int, int, int], size: float) -> None:
    """Write text at the lower left, on a dark background so that it is legible on any picture."""
    font, letter = cv2.FONT_HERSHEY_SIMPLEX, 0.5 * size
    (width, height), below = cv2.getTextSize(words, font, letter, max(1, round(size)))
    letter *= min(1.0, 0.96 * canvas.shape[1] / max(width, 1))
    (width, height), below = cv2.getTextSize(words, font, letter, max(1, round(size)))
    margin = round(5 * size)
    bottom = canvas.shape[0] - margin - below
    cv2.rectangle(canvas, (0, bottom - height - margin), (width + 2 * margin, canvas.shape[0] - 1), BACKING, -1)
    cv2.putText(canvas, words, (margin, bottom), font, letter, colour, max(1, round(size)), cv2.LINE_AA)
