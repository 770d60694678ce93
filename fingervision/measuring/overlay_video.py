"""Write overlay.mp4: the recording with the measured edges drawn in, at the recording's own times."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from types import TracebackType

import av
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError, OutputError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.frames.source import Description
from fingervision.storage.gaps_csv import GapRow
from fingervision.vision.overlay import draw_overlay

# Clock of MPEG; MP4 files store times to one tick of this clock.
CLOCK_HZ = 90_000
# Frame rate of the video for frames without times.
SHOWN_AT_HZ = 25.0
OPTIONS = {"crf": "20", "preset": "veryfast"}


class OverlayVideo:
    """Writes the overlay video frame by frame.

    Frames that could not be decoded are left out, and so are frames whose time is not later than the previous frame's
    time.

    Parameters
    ----------
    path : Path
        Path of the video.
    description : Description
        Description of the recording.

    Raises
    ------
    FingervisionError
        The video cannot be written; also raised by `add` and at the end of the `with` block.
    """

    def __init__(self, path: Path, description: Description) -> None:
        self._path = path
        self._last_tick = -1
        self._first_s: float | None = None
        # H.264 with chroma subsampling needs an even width and height; an odd last column or row is repeated.
        self._pad = ((0, description.height_px % 2), (0, description.width_px % 2), (0, 0))
        try:
            self._container = av.open(f"file:{path}", "w", options={"movie_timescale": str(CLOCK_HZ)})
            self._stream = self._container.add_stream("libx264", options=OPTIONS)
        except (av.FFmpegError, OSError, ValueError) as error:
            raise self._failed(error) from error
        self._stream.width = description.width_px + description.width_px % 2
        self._stream.height = description.height_px + description.height_px % 2
        self._stream.pix_fmt = "yuv420p"
        self._stream.codec_context.time_base = self._stream.time_base = Fraction(1, CLOCK_HZ)

    def __enter__(self) -> "OverlayVideo":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._container.mux(self._stream.encode(None))
            self._container.close()
        except (av.FFmpegError, OSError) as failure:
            if error is None:
                raise self._failed(failure) from failure

    def add(
        self,
        frame: Frame,
        outcome: GapMeasurement | NoGap | LostFrame,
        row: GapRow,
        draw_more: Callable[[NDArray[np.uint8]], None] | None = None,
    ) -> None:
        """Draw the result into one frame and write it; `draw_more` draws into the same picture."""
        time_s = frame.index / SHOWN_AT_HZ if frame.time_s is None else frame.time_s
        if self._first_s is None:
            self._first_s = min(0.0, time_s)  # a video cannot start before 0
        tick = round((time_s - self._first_s) * CLOCK_HZ)
        if tick <= self._last_tick or isinstance(outcome, LostFrame):
            return
        self._last_tick = tick
        canvas = draw_overlay(frame, outcome, words_of_row(row))
        if draw_more is not None:
            draw_more(canvas)
        drawn = np.pad(canvas, self._pad, mode="edge")
        picture = av.VideoFrame.from_ndarray(drawn, format="rgb24")
        picture.pts, picture.time_base = tick, Fraction(1, CLOCK_HZ)
        try:
            self._container.mux(self._stream.encode(picture))
        except (av.FFmpegError, OSError) as error:
            raise self._failed(error) from error

    def _failed(self, error: Exception) -> FingervisionError:
        why = getattr(error, "strerror", None) or str(error)
        return OutputError(
            f"{self._path} could not be written ({why}): free disk space, name another folder with --out, or "
            "leave out --overlay."
        )


def words_of_row(row: GapRow) -> str:
    """Frame, time and gap in one line, with U = 2 u; without an uncertainty budget, u is the random part."""
    place = f"{row.frame}" if row.time_s is None else f"{row.frame}  {row.time_s:.3f} s"
    if row.gap_mm is None or row.u_random_mm is None:
        return place if row.status is Status.NOT_ASKED else f"{place}  {row.status.value}"
    u_mm = row.u_random_mm if row.u_gap_mm is None else row.u_gap_mm
    return f"{place}  gap {row.gap_mm:.4f} mm  U {2.0 * u_mm:.4f} mm"
