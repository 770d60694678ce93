"""One frame of a live view: what it says, and the row of the table that it becomes."""

from dataclasses import dataclass

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.live.choices import Choices
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.pipeline import measure_frame


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The newest frame and what it says.

    Parameters
    ----------
    frame : Frame
        The picture.
    outcome : GapMeasurement, NoGap or None
        None as long as there is no scale.
    row : GapRow or None
        As in gaps.csv.
    """

    frame: Frame
    outcome: GapMeasurement | NoGap | None
    row: GapRow | None


class FrameMeasurement:
    """Measures the frames of one source in order, as a recording of it is measured.

    Parameters
    ----------
    frame_size_px : (int, int)
        Width and height of the frames.
    """

    def __init__(self, frame_size_px: tuple[int, int]) -> None:
        self._frame_size_px = frame_size_px
        self._pictures = SoundPictures()

    def measured(
        self, item: Frame | LostFrame, choices: Choices
    ) -> tuple[Frame | LostFrame, GapMeasurement | NoGap | None, GapRow | None]:
        """Measure a frame.

        Parameters
        ----------
        item : Frame or LostFrame
            As it came.
        choices : Choices
            What the user chose.

        Returns
        -------
        item : Frame or LostFrame
            The same, or that its picture is damaged.
        outcome : GapMeasurement, NoGap or None
            What it says; None of a lost frame, and as long as there is no scale.
        row : GapRow or None
            As in gaps.csv; None as long as there is no scale.
        """
        task = choices.task
        if task is None:
            return item, None, None
        found: GapMeasurement | NoGap | LostFrame = item if isinstance(item, LostFrame) else self._found(item, choices)
        (row,) = RowMaker(task.scale, self._frame_size_px).rows((Result(item.index, item.time_s, found),))
        if isinstance(found, LostFrame):
            return found, None, row
        return item, found, row

    def _found(self, frame: Frame, choices: Choices) -> GapMeasurement | NoGap | LostFrame:
        assert choices.task is not None  # noqa: S101 - asked before
        return self._pictures.judged(frame, measure_frame(frame, choices.task.settings))
