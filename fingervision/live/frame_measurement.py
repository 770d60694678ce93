"""Measurement of one frame of a live view, and its table row."""

from dataclasses import dataclass, replace
from pathlib import Path

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.live.choices import Choices
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.pipeline import measure_frame


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The newest frame with its result.

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
    """Measures the frames of one source in order, in the same way as those of a recording.

    Parameters
    ----------
    frame_size_px : (int, int)
        Width and height of the frames.
    files : tuple of Path
        What a recording is made of, which may say how its levels are coded; empty for a live source.
    fingers_are_dark : bool or None
        Where it is known of the recording; None finds out in every frame.
    """

    def __init__(
        self, frame_size_px: tuple[int, int], files: tuple[Path, ...] = (), fingers_are_dark: bool | None = None
    ) -> None:
        self._frame_size_px, self._files, self._fingers_are_dark = frame_size_px, files, fingers_are_dark
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
        settings, _ = choices.task.settings_for(self._files)
        if self._fingers_are_dark is not None:
            settings = replace(settings, fingers_are_dark=self._fingers_are_dark)
        return self._pictures.judged(frame, measure_frame(frame, settings))
