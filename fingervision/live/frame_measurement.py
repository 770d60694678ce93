"""Measurement of single frames of a live view, and their table rows."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.live.choices import Choices
from fingervision.live.live_camera import LiveCamera
from fingervision.measuring.rows import Result, RowMaker
from fingervision.measuring.sound_picture import SoundPictures
from fingervision.measuring.temporal_filter import Lagging
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.pipeline import measure_frame


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The most recent frame with its result.

    Parameters
    ----------
    frame : Frame
        The frame with its picture.
    outcome : GapMeasurement, NoGap or None
        Result of the measurement; None until the scale is known.
    row : GapRow or None
        Row of the frame as in gaps.csv; None until the scale is known.
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
        Files of a recording, whose metadata may state the coding of grey levels; empty for a live source.
    fingers_are_dark : bool or None
        Whether the fingers are darker than the background; None to detect this in every frame.
    tell : callable
        Called with a sentence once the camera has been learnt.
    """

    def __init__(
        self,
        frame_size_px: tuple[int, int],
        files: tuple[Path, ...] = (),
        fingers_are_dark: bool | None = None,
        tell: Callable[[str], None] = lambda words: None,
    ) -> None:
        self._frame_size_px, self._files, self._fingers_are_dark = frame_size_px, files, fingers_are_dark
        self._pictures, self._camera, self._lagging = SoundPictures(), LiveCamera(tell), Lagging()

    def measured(
        self, item: Frame | LostFrame, choices: Choices
    ) -> tuple[Frame | LostFrame, GapMeasurement | NoGap | None, GapRow | None]:
        """Measure a frame.

        Parameters
        ----------
        item : Frame or LostFrame
            The frame as received.
        choices : Choices
            Settings chosen by the user.

        Returns
        -------
        item : Frame or LostFrame
            The same frame, or a lost frame if the picture proved to be damaged.
        outcome : GapMeasurement, NoGap or None
            Result of the measurement; None for a lost frame, and until the scale is known.
        row : GapRow or None
            Row of the frame as in gaps.csv; None until the scale is known.
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
        settings = self._camera.used(choices.task.settings_for(self._files)[0], choices.task)
        if self._fingers_are_dark is not None:
            settings = replace(settings, fingers_are_dark=self._fingers_are_dark)
        outcome = self._pictures.judged(frame, measure_frame(frame, settings))
        if isinstance(outcome, GapMeasurement):
            self._camera.add(frame, settings, choices.task)
        return self._lagging.added(frame.index, outcome, settings.camera.lag)
