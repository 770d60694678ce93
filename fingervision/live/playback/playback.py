"""A recording in the browser page: display of frames while the recording is measured in the background."""

from bisect import bisect_left
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Condition, Event, Thread
from time import monotonic
from typing import Any

from fingervision.domain.errors import DataError, LimitError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.own_process import in_own_process
from fingervision.domain.status import Status
from fingervision.frames.image_folder import ImageFolder
from fingervision.frames.seeking import Seeking, frame_times_s, seeking
from fingervision.live.choices import MOVES_ZERO
from fingervision.live.frame_measurement import Seen
from fingervision.live.playback.recorded import Recorded, recorded_frame
from fingervision.live.playback.track import Track, arguments_of
from fingervision.live.supervisor import told
from fingervision.live.view import View
from fingervision.measuring.marked import marked
from fingervision.storage.gaps_csv import TIME_PLACES, GapRow
from fingervision.storage.run_files import lost_frames

# Access to single frames of a recording by number, which never returns a different frame.


# Memory for pictures that are stored for stepping back.
KEPT_BYTES = 64_000_000
# A frame at most this far ahead is reached by reading on, which is faster than seeking.
NEAR_FRAMES = 12
# Number of frames before a wanted one that are kept if they were decoded on the way.
KEPT_BEFORE = 25
# Largest difference of two times that are written alike (s).
SAME_S = 0.6 * 10.0**-TIME_PLACES

Item = Frame | LostFrame


class OvertakenError(Exception):
    """Another frame is wanted before the one that was asked for has been decoded."""


class FrameReader:
    """Reads frames of a recording in any order.

    A frame is accessed by its time if the table of the recording states this time and the source allows random access;
    otherwise the recording is read from its beginning and frames are counted, as `measure` does.

    Parameters
    ----------
    begin : callable
        Function that starts reading the recording from its beginning.
    name : str
        Name of the recording.
    images : ImageFolder, optional
        The recording, if every frame is a file of its own. A lost frame is then read again at each access, because a
        file that was missing may be there again.
    """

    def __init__(self, begin: Callable[[], Iterator[Item]], name: str, images: ImageFolder | None = None) -> None:
        self._begin = begin
        self._images = images
        self._items = begin()
        self._following = 0
        self._kept: OrderedDict[int, Item] = OrderedDict()
        self._seeking: Seeking | None = seeking(name)

    def at(
        self, index: int, time_of: Callable[[int], float | None], passes: Callable[[Frame], None] = lambda frame: None
    ) -> Item | None:
        """Return the frame with a given number in the recording.

        Parameters
        ----------
        index : int
            Number of the frame, from 0.
        time_of : callable
            Function that returns the time of a frame (s), or None if it is not known surely or if a neighbouring
            frame has the same time. It is called only where the time is needed, and may wait for it.
        passes : callable, optional
            Called with each frame, without its number, that is decoded on the way from a key frame; what it raises ends
            the way.

        Returns
        -------
        Frame, LostFrame or None
            The frame; None beyond the end of the recording.

        Raises
        ------
        FingervisionError
            The recording cannot be read any more.
        """
        if index in self._kept:
            self._kept.move_to_end(index)
            return self._kept[index]
        if self._images is not None:
            if index >= len(self._images.description.files):
                return None
            image = self._images.frame(index)
            if isinstance(image, Frame):
                self._keep(image)
            return image
        is_near = self._following <= index < self._following + NEAR_FRAMES
        if not is_near and self._seeking is not None and (time_s := time_of(index)) is not None:
            found = self._sought(self._seeking, index, time_s, time_of, passes)
            if found is not None:
                return found
        return self._counted(index)

    def _sought(
        self,
        source: Seeking,
        index: int,
        time_s: float,
        time_of: Callable[[int], float | None],
        passes: Callable[[Frame], None],
    ) -> Frame | None:
        """Decode a frame from the last key frame on, and keep those on the way: people step back."""
        passed: deque[Frame] = deque(maxlen=KEPT_BEFORE)

        def also_kept(frame: Frame) -> None:
            passed.append(frame)
            passes(frame)

        found = source.frame(index, time_s, also_kept)
        if found is None:
            return None
        before: list[Frame] = []
        for number, frame in enumerate(reversed(passed), start=1):
            at_s = time_of(index - number)
            if at_s is None or frame.time_s is None or abs(at_s - frame.time_s) > SAME_S:
                break
            before.append(replace(frame, index=index - number, time_s=at_s))
        for frame in (*reversed(before), found):
            self._keep(frame)
        return found

    def _counted(self, index: int) -> Item | None:
        if index < self._following:
            self._items, self._following = self._begin(), 0
        for item in self._items:
            self._following = item.index + 1
            self._keep(item)
            if item.index == index:
                return item
        self._items, self._following = self._begin(), 0
        return None

    def _keep(self, item: Item) -> None:
        self._kept[item.index] = item
        size = sum(each.pixels.nbytes for each in self._kept.values() if isinstance(each, Frame))
        while size > KEPT_BYTES and len(self._kept) > 1:
            _, oldest = self._kept.popitem(last=False)
            size -= oldest.pixels.nbytes if isinstance(oldest, Frame) else 0


# Frame rate at which a recording without times is played.
USUAL_RATE_HZ = 25.0
# Time between two checks whether the displayed frame must change.
LOOK_EVERY_S = 0.02
SPEEDS = (0.01, 100.0)
NO_PICTURE = (Status.DAMAGED, Status.DUPLICATE)
PLAYING, MEASURING = "Playing the recording", "Measuring the recording"


class Playback(View):
    """Plays a recording in a separate thread.

    Parameters
    ----------
    opened : Recorded
        The recording with its measurement settings.
    out : Path
        Folder for files that the user saves.
    """

    def __init__(self, opened: Recorded, out: Path) -> None:
        super().__init__(opened.source.description, opened.choices, out)
        self.recorded = opened
        self.range: tuple[int, int] | None = None
        self.on_table: Callable[[Sequence[GapRow]], None] = lambda rows: None
        """Function that is called with all rows whenever the table of the recording is complete."""
        self.on_stop: list[Callable[[], None]] = []
        """Functions that are called before the playback ends."""
        self.companions: list[Playback] = []
        """Recordings that are measured with the same settings."""
        self._told: Track | None = None
        self.is_playing, self.speed, self.frame = False, 1.0, 0
        self._track: Track | None = None
        marks = lost_frames(self.description.files)
        self._is_marked = bool(marks)
        source = opened.source
        self._reader = FrameReader(
            lambda: iter(marked(source, marks) if marks else source),
            opened.name,
            source if isinstance(source, ImageFolder) else None,
        )
        # Times from the packets, for frames that the table has not reached.
        self._times_s: list[float] = []
        self._times_read = Event()
        self._shown: object = None
        self._requests = 0
        self._stopped = False
        self._changed = Condition()
        self._thread: Thread | None = None
        for note in self.description.notes:
            self.say("recording", note)

    def start(self) -> None:
        """Start the measurement and the display."""
        self._measure_anew()
        self._thread = self.supervisor.start(PLAYING, self._play)
        self.supervisor.start("Reading the times of the recording", self._read_times)

    def stop(self) -> None:
        """Stop the measurement and the display."""
        for end in self.on_stop:
            end()
        with self._changed:
            self._stopped = True
            self._times_read.set()
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()
        if self._track is not None:
            self._track.close()

    # ---- requests of the browser page
    def seek(self, frame: int) -> None:
        """Show a frame; for a number beyond the ends of the recording, the first or last frame."""
        with self._changed:
            self.is_playing = False
            self.frame = max(0, min(frame, self.frame_count - 1))
            self._requests += 1  # the same frame is read again, because its file may have been put back
            self._changed.notify_all()

    def frame_at(self, time_s: float) -> int:
        """Return the frame whose time is nearest to a time (s) of the recording."""
        following = bisect_left(range(self.frame_count), time_s, key=self._time_of)
        near = (max(0, following - 1), min(following, self.frame_count - 1))
        return min(near, key=lambda frame: abs(self._time_of(frame) - time_s))

    def play(self, *, on: bool, speed: float) -> None:
        """Play from the displayed frame (from the beginning if it is the last), or pause.

        Raises
        ------
        LimitError
            The speed is outside the permitted range.
        """
        if not SPEEDS[0] <= speed <= SPEEDS[1]:
            raise LimitError(f"The speed must be {SPEEDS[0]:g} to {SPEEDS[1]:g}, but is {speed:g}.")
        with self._changed:
            self.speed = speed
            if on and self.frame >= self.frame_count - 1:
                self.frame = 0
            self.is_playing = on
            self._began = (monotonic(), self._time_of(self.frame))
            self._changed.notify_all()

    def mark(self, first: int | None, last: int | None) -> None:
        """Mark a range of frames, or remove the mark.

        Raises
        ------
        LimitError
            The range does not lie within the recording.
        """
        if first is None or last is None:
            self.range = None
            return
        if not 0 <= first <= last < self.frame_count:
            raise LimitError(
                f"The range must lie within frames 0 to {self.frame_count - 1} and must not begin after its end, but "
                f"is {first} to {last}."
            )
        self.range = (first, last)

    def choose(self, **changes: Any) -> None:
        """Change settings; if they affect the measurement, the recording is measured again.

        Raises
        ------
        DataError, UsageError
            The choice does not fit the recording's frames.
        """
        super().choose(**changes)
        for each in self.companions:
            each.choose(**changes)
        if MOVES_ZERO & set(changes):
            self._measure_anew()

    # ---- data for the browser page
    @property
    def time_s(self) -> float:
        """Time of the displayed frame (s)."""
        return self._time_of(self.frame)

    @property
    def table(self) -> Path | None:
        """The gaps.csv of the complete recording; None until the whole recording is measured."""
        track = self._track
        return track.table if track is not None and track.is_whole else None

    @property
    def row_count(self) -> int:
        """Number of rows measured so far."""
        track = self._track
        return 0 if track is None else len(track.rows)

    def rows(self, first: int, last: int) -> Iterator[GapRow]:
        """Rows of the table for the frames from `first` to `last` - 1."""
        track = self._track
        return iter(() if track is None else track.rows[first:last])

    @property
    def frame_count(self) -> int:
        """Number of frames of the recording, as far as known."""
        if self.table is not None:
            return max(1, self.row_count)
        return max(1, self.description.frame_count or 0, self.row_count)

    def state(self) -> dict[str, Any]:
        """Return the state of the playback, for the browser page."""
        counts: Counter[Status] = Counter() if self._track is None else self._track.counts
        return {
            **super().state(),
            "whole": True,
            "duplicates": counts[Status.DUPLICATE],
            "damaged": counts[Status.DAMAGED],
            "ended": bool(self.supervisor.trouble_of(PLAYING)),
        }

    @property
    def failure(self) -> str:
        """Reason why the recording could not be measured; empty without a failure."""
        return "" if self._track is None else self._track.failure

    # ---- the thread
    def _measure_anew(self) -> None:
        with self._changed:
            if self._track is not None:
                self._track.close()
            self._track = None
            if self.choices.scale is not None:
                arguments = arguments_of(self.recorded.name, self.choices, self.recorded.options)
                self._track = Track(arguments)
            self.renew()
            self._shown = None
            self.supervisor.clear(MEASURING)
            self._changed.notify_all()

    def _read_times(self) -> None:
        # What FFmpeg says of damage is heard by all threads, so that one reader's damage would be taken for another's.
        try:
            if not self._is_marked:
                times_s = in_own_process(frame_times_s, self.recorded.name)
                self._times_s = [round(time_s, TIME_PLACES) for time_s in times_s]
        finally:
            self._times_read.set()

    def _told_time(self, frame: int) -> float | None:
        """Time of a frame (s) by its packet; None if the table so far shows that packets do not number the frames."""
        last = self._row(self.row_count - 1)
        is_refuted = last is not None and self._times_s[last.frame : last.frame + 1] != [last.time_s]
        return None if is_refuted or frame >= len(self._times_s) else self._times_s[frame]

    def _row(self, frame: int) -> GapRow | None:
        track = self._track
        return track.rows[frame] if track is not None and 0 <= frame < len(track.rows) else None

    def _time_of(self, frame: int) -> float:
        row = self._row(frame)
        if row is not None and row.time_s is not None:
            return row.time_s
        told_s = self._told_time(frame)
        return frame / (self.description.rate_hz or USUAL_RATE_HZ) if told_s is None else told_s

    def _play(self) -> None:
        while not self._stopped:
            with self._changed:
                with self.supervisor.watching("Reading the table of the recording"):
                    self._follow_table()
                self._advance()
                frame, row = self.frame, self._row(self.frame)
                wanted = (frame, row, self._generation, self._requests, self.choices)
                if self._shown == wanted:
                    self._changed.wait(LOOK_EVERY_S)
                    continue
            with suppress(OvertakenError):
                self._show(frame, row)
                self._shown = wanted

    def _follow_table(self) -> None:
        track = self._track
        if track is None:
            return
        if track.refresh():
            self.renew()
        if track.failure and not track.is_whole:
            self.supervisor.alarm(MEASURING, track.failure)
        if track.is_whole and self._told is not track:
            self._told = track
            with self.supervisor.watching("Comparing with the model"):
                self.on_table(track.rows)

    def _advance(self) -> None:
        """Advance the display according to the elapsed time; frames that cannot be shown in time are skipped."""
        if not self.is_playing:
            return
        began_s, from_s = self._began
        until_s = from_s + (monotonic() - began_s) * self.speed
        last = self.frame_count - 1
        while self.frame < last and self._time_of(self.frame + 1) <= until_s:
            self.frame += 1
        if self.frame >= last:
            self.is_playing = False

    def _show(self, frame: int, row: GapRow | None) -> None:
        try:
            item = self._reader.at(frame, self._own_time, self._on_the_way(frame))
            self._refuse_missing(item, frame, row)
            if item is None:
                item = LostFrame(frame, None, Status.DAMAGED, "The recording has no frame of this number.")
            self.seen = recorded_frame(item, row, self.choices, self.description)
            self.supervisor.clear(PLAYING)
        except OvertakenError:
            raise
        except Exception as error:  # a file that was changed or removed may make a decoder raise any error
            self.is_playing = False
            self.supervisor.alarm(
                PLAYING,
                f"The recording cannot be read any more: {told(error)} Put the file back, and select the frame again.",
            )

    def _refuse_missing(self, item: Item | None, frame: int, row: GapRow | None) -> None:
        if row is not None and row.status not in NO_PICTURE and not isinstance(item, Frame):
            raise DataError(
                f"Frame {frame} of {self.recorded.name} must be there, because it was measured, but is not."
            )

    def _on_the_way(self, wanted: int) -> Callable[[Frame], None]:
        """What is done with frames that are decoded before a wanted one: the first of a long way is shown meanwhile.

        Its value is that of its own row. The way ends if another frame is wanted.
        """
        is_first = True

        def passes(frame: Frame) -> None:
            nonlocal is_first
            if is_first and frame.time_s is not None:
                number = self.frame_at(frame.time_s)
                time_s = self._own_time(number)
                if number + NEAR_FRAMES < wanted and time_s is not None and abs(time_s - frame.time_s) <= SAME_S:
                    self.seen = Seen(replace(frame, index=number), None, self._row(number))
            is_first = False
            if self.frame != wanted:
                raise OvertakenError

        return passes

    def _own_time(self, frame: int) -> float | None:
        """Time by which a frame is found (s); None without a picture, or if a neighbouring frame has the same time."""
        row = self._row(frame)
        if row is None:
            self._times_read.wait()  # some seconds, while counting the frames of an hour would take minutes
            return self._told_time(frame)
        if row.time_s is None or row.status in NO_PICTURE:
            return None
        neighbours = [self._row(frame - 1) if frame else None, self._row(frame + 1)]
        return None if any(each is not None and each.time_s == row.time_s for each in neighbours) else row.time_s
