"""Distinguish a real jump of the fingers from picture damage that the decoder did not report.

A jump alone does not prove damage, because stages make steps. Visible blocks alone do not prove damage either, because
coarse coding makes them visible. A picture counts as damaged if the measured position jumps and squares of the codec's
grid appear that are neither in the previous picture nor in that picture shifted with the fingers. All later pictures
that are coded as differences from a damaged picture are also damaged.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.measuring.block_damage import SQUARE_PX, Levels, foreign_corners
from fingervision.measuring.finger_motion import Place, jumps, place
from fingervision.vision.grey import GreyImage, to_grey

# Least number of corners of foreign squares, and least step in units of the fingers' contrast. Undamaged videos (H.264
# of crf 18 to 45, Motion JPEG of quality 3 to 31, steps of 7 and 16 px, noise of 1 to 4 levels, and videos of real
# drops; 2000 frames, whole pictures) had at most one corner with steps of 0.08 of the contrast, and two corners with
# steps of 0.06; a damaged square has four corners.
FEWEST_CORNERS, LEAST_STEP = 2, 0.08
# Extent of the inspected region around the measuring points: below them (pixels and measuring heights), to both sides,
# and beyond the tips.
REACH_PX, REACH_HEIGHTS, ASIDE_PX, BEYOND_TIP_PX = 45.0, 1.5, 64.0, 16.0

WORDS = (
    "The recording is damaged at this frame: the picture contains squares that the previous picture does not have and "
    "that do not move with the fingers."
)
WORDS_BEHIND = "The frame is coded as a difference to a damaged frame."


@dataclass(frozen=True, slots=True, eq=False)
class _Sound:
    """The last frame that was accepted as undamaged, with its result and its number."""

    frame: Frame
    outcome: GapMeasurement


class SoundPictures:
    """Checks the frames of one recording in order; losslessly stored frames have checksums and are not checked."""

    def __init__(self) -> None:
        self._last: _Sound | None = None
        self._places: list[Place] = []
        self._is_broken = False

    def judged(self, frame: Frame, outcome: GapMeasurement | NoGap) -> GapMeasurement | NoGap | LostFrame:
        """Return the result of a frame, or report the frame as damaged.

        Parameters
        ----------
        frame : Frame
            The picture.
        outcome : GapMeasurement or NoGap
            Result of the measurement.

        Returns
        -------
        GapMeasurement, NoGap or LostFrame
            The same result, or a lost frame if the frame is damaged.
        """
        if frame.coding is Coding.LOSSLESS:
            return outcome
        if self._is_broken and frame.hangs_on_others:
            return LostFrame(frame.index, frame.time_s, Status.DAMAGED, WORDS_BEHIND)
        self._is_broken = False
        last = self._last
        now = place(frame.index, outcome) if isinstance(outcome, GapMeasurement) else None
        # Without two frames directly before it, a frame cannot be compared with their motion.
        follows = len(self._places) > 1 and frame.index - self._places[-2].at == 2
        is_smooth = now is not None and follows and not jumps(self._places, now)
        if last is not None and not is_smooth and _is_foreign(frame, outcome, last):
            self._is_broken = frame.coding is Coding.INTERFRAME
            return LostFrame(frame.index, frame.time_s, Status.DAMAGED, WORDS)
        if now is not None and isinstance(outcome, GapMeasurement):
            self._places, self._last = [*self._places, now][-3:], _Sound(frame, outcome)
        return outcome


def _is_foreign(frame: Frame, outcome: GapMeasurement | NoGap, last: _Sound) -> bool:
    """Whether the picture shows squares of the codec's grid that the last undamaged picture lacks, shifted or not."""
    if frame.pixels.shape != last.frame.pixels.shape:
        return False
    least_step = LEAST_STEP * min(abs(last.outcome.left.contrast), abs(last.outcome.right.contrast))
    part = _part(last.outcome if isinstance(outcome, NoGap) else outcome, frame)
    if _has_squares(frame, outcome, last, part, least_step, levels_only=False):
        return True
    if frame.coding is not Coding.INTRAFRAME:
        return False
    # JPEG codes the level of each block as a difference to the previous block, so that a damaged level changes all
    # blocks up to the next restart marker; the only corners may then be far from the fingers.
    whole = _squares(0, frame.height_px, frame.height_px), _squares(0, frame.width_px, frame.width_px)
    return _has_squares(frame, outcome, last, whole, least_step, levels_only=True)


def _has_squares(
    frame: Frame,
    outcome: GapMeasurement | NoGap,
    last: _Sound,
    part: tuple[slice, slice],
    least_step: float,
    levels_only: bool,
) -> bool:
    """Whether a part of the picture shows squares that the last undamaged picture lacks, shifted or not."""
    rows, columns = part
    if rows.stop - rows.start < 2 * SQUARE_PX or columns.stop - columns.start < 2 * SQUARE_PX:
        return False
    picture = to_grey(frame.pixels[rows, columns])
    before = to_grey(last.frame.pixels[rows, columns])
    if foreign_corners(picture, before, least_step, levels_only) < FEWEST_CORNERS:
        return False
    if isinstance(outcome, NoGap):
        return True
    moved = _moved(to_grey(last.frame.pixels), last.outcome, outcome)[rows, columns]
    return foreign_corners(picture, moved, least_step, levels_only) >= FEWEST_CORNERS


def _part(outcome: GapMeasurement, frame: Frame) -> tuple[slice, slice]:
    """Region of the picture that contains the measurement, in whole blocks of the codec's grid."""
    sides = (outcome.left, outcome.right)
    vertical = outcome.direction.is_vertical
    across = [side.x_px if vertical else side.y_px for side in sides]
    at = [side.y_px if vertical else side.x_px for side in sides]
    tips = [side.tip_px for side in sides]
    height = max(abs(point - tip) for point, tip in zip(at, tips, strict=True))
    towards_root = 1.0 if sum(at) > sum(tips) else -1.0
    ends = [tip - towards_root * BEYOND_TIP_PX for tip in tips]
    ends += [point + towards_root * max(REACH_PX, REACH_HEIGHTS * height) for point in at]
    along_part = _squares(min(ends), max(ends), frame.height_px if vertical else frame.width_px)
    across_part = _squares(
        min(across) - ASIDE_PX, max(across) + ASIDE_PX, frame.width_px if vertical else frame.height_px
    )
    return (along_part, across_part) if vertical else (across_part, along_part)


def _squares(least: float, most: float, size: int) -> slice:
    begin = max(0, int(least // SQUARE_PX)) * SQUARE_PX
    end = min(size // SQUARE_PX, int(-(-most // SQUARE_PX))) * SQUARE_PX
    return slice(begin, max(begin, end))


def _moved(grey: GreyImage, before: GapMeasurement, now: GapMeasurement) -> Levels:
    """Shift each finger's half of a picture by the displacement of that finger."""
    levels = np.asarray(grey, dtype=np.float32)
    vertical = now.direction.is_vertical
    middle = 0.5 * ((now.left.x_px + now.right.x_px) if vertical else (now.left.y_px + now.right.y_px))
    halves = []
    for old, new in ((before.left, now.left), (before.right, now.right)):
        along = new.tip_px - old.tip_px
        x_px = new.x_px - old.x_px if vertical else along
        y_px = along if vertical else new.y_px - old.y_px
        shift = np.array([[1.0, 0.0, x_px], [0.0, 1.0, y_px]])
        size = (levels.shape[1], levels.shape[0])
        halves.append(cv2.warpAffine(levels, shift, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
    moved = np.array(halves[0], dtype=np.float32)
    behind = int(max(0.0, middle)) + 1
    if vertical:
        moved[:, behind:] = halves[1][:, behind:]
    else:
        moved[behind:] = halves[1][behind:]
    return moved
