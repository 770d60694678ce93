"""One frame of a recording with its table row, and with a separate measurement of this frame."""

from dataclasses import replace

import numpy as np

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.frames.source import Description
from fingervision.live.choices import Choices
from fingervision.live.frame_measurement import FrameMeasurement, Seen
from fingervision.storage.gaps_csv import GapRow

# Grey level of the even picture that is shown in place of a frame that could not be decoded.
NO_PICTURE_LEVEL = 90
IN_THE_TABLE = "This result is from the table, for which the preceding frames were used too."


def recorded_frame(item: Frame | LostFrame, row: GapRow | None, choices: Choices, description: Description) -> Seen:
    """Combine picture, measured points and table row of a frame.

    Parameters
    ----------
    item : Frame or LostFrame
        The frame as read from the recording.
    row : GapRow or None
        Row of this frame in the table of the recording; None until the measurement has reached this frame.
    choices : Choices
        Settings of the measurement.
    description : Description
        Description of the recording.

    Returns
    -------
    Seen
        The frame with its row from the table, whose measurement uses the preceding frames; until this row exists, a row
        from the measurement of the single frame.
    """
    if isinstance(item, LostFrame):
        pixels = np.full((description.height_px, description.width_px), NO_PICTURE_LEVEL, np.uint8)
        frame = Frame(pixels, item.index, item.time_s, description.coding)
        return Seen(frame, NoGap(item.status, item.words), row or GapRow(item.index, item.time_s, item.status))
    polarity = None if row is None or not row.fingers else row.fingers == "dark"
    measurement = FrameMeasurement((description.width_px, description.height_px), description.files, polarity)
    _, outcome, own = measurement.measured(item, choices)
    if row is None or own is None or row.status is own.status:
        return Seen(item, outcome, row or own)
    if isinstance(outcome, GapMeasurement) or outcome is None:
        outcome = NoGap(row.status, IN_THE_TABLE)
    return Seen(item, replace(outcome, words=IN_THE_TABLE), row)
