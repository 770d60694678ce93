"""Operation of a live view: measurement, browser page or terminal, and an orderly end at any signal."""

import json
import os
import signal
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import Empty, Full, Queue
from threading import Event
from time import monotonic
from types import FrameType
from typing import TextIO

from fingervision.domain.errors import DeviceError, ExitCode
from fingervision.live.access import Access
from fingervision.live.beside import Beside, compared, stand_beside
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.playback.gauge_following import put_gauges_beside
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import Recorded
from fingervision.live.playback.second_recording import beside_recording
from fingervision.live.run_folder import remove_leftovers
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.live.supervisor import Supervisor
from fingervision.live.view import Message
from fingervision.storage.gaps_csv import GapRow

# Print in a separate thread, so that a slow or missing reader delays neither measurement nor recording.


# Largest number of queued lines: ten minutes at 25 frames per second. Further lines are left out and counted.
LINES_WAITING = 15_000
# Longest time that a reader may take at the end for the queued lines.
PATIENCE_S = 2.0


class Outlet:
    """Prints text to one output stream in a separate thread.

    Parameters
    ----------
    stream : text stream or None
        Standard output or standard error; None if the stream was closed before the program began.
    supervisor : Supervisor
        Supervisor of the live view.
    waiting : int
        Largest number of queued lines.
    """

    def __init__(self, stream: TextIO | None, supervisor: Supervisor, waiting: int = LINES_WAITING) -> None:
        self.left_out = 0
        self.broken = stream is None
        """Whether the stream is closed, so that text cannot be printed any more."""
        self._stream = stream
        self._waiting: Queue[str] = Queue(waiting)
        self._ending = Event()
        self._thread = supervisor.start("Printing", self._print)

    def put(self, text: str) -> None:
        """Queue text for printing; never waits."""
        if self.broken:
            return
        try:
            self._waiting.put_nowait(text)
        except Full:
            self.left_out += 1

    def close(self) -> None:
        """Print the queued text, as far as the reader accepts it in time."""
        self._ending.set()
        self._thread.join(PATIENCE_S)
        if self._thread.is_alive():
            self.left_out += self._waiting.qsize()
            self.broken = True
        if self.broken:
            self._let_go()

    def _print(self) -> None:
        while not (self._ending.is_set() and self._waiting.empty()):
            try:
                text = self._waiting.get(timeout=0.1)
            except Empty:
                continue
            if self._stream is None:
                return
            try:
                self._stream.write(text)
                self._stream.flush()
            except (OSError, ValueError):
                self.broken = True
                return

    def _let_go(self) -> None:
        """Redirect the stream to the null device, so that Python neither fails nor waits at the final flush."""
        if self._stream is None:
            return
        with suppress(OSError, ValueError):
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, self._stream.fileno())
            os.close(nothing)


# The live measurement in a terminal: one line that is overwritten, or one line of JSON per frame.


# Time between two lines: on a terminal, where the line is overwritten, and elsewhere.
EVERY_S, EVERY_S_ELSEWHERE = 0.1, 1.0
CLEARED = "\r\x1b[2K"
DRIVE_COLUMNS = ("run", "input_mm", "force_n")


class JsonLines:
    """Prints one line of JSON per frame, with the columns of gaps.csv; null represents an empty cell.

    Parameters
    ----------
    outlet : Outlet
        Standard output.
    """

    def __init__(self, outlet: Outlet) -> None:
        self._outlet = outlet

    def add(self, row: GapRow, arrived_s: float) -> None:
        """Print one row."""
        cells = {name: cell for name, cell in asdict(row).items() if name not in DRIVE_COLUMNS}
        self._outlet.put(json.dumps(cells) + "\n")


class StatusLine:
    """Prints gap, status and frame rate in a line that is overwritten.

    Parameters
    ----------
    session : Session
        The live measurement.
    outlet : Outlet
        Standard output.
    in_place : bool
        Whether the output is a terminal, so that the line can be overwritten.
    """

    def __init__(self, session: Session, outlet: Outlet, *, in_place: bool) -> None:
        self._session, self._outlet, self._in_place = session, outlet, in_place
        self._printed_at_s = float("-inf")

    def add(self, row: GapRow, arrived_s: float) -> None:
        """Print the row if the display interval has passed."""
        if monotonic() - self._printed_at_s < (EVERY_S if self._in_place else EVERY_S_ELSEWHERE):
            return
        self._printed_at_s = monotonic()
        line = self._line(row)
        self._outlet.put(f"{CLEARED}{line}" if self._in_place else f"{line}\n")

    def end(self) -> None:
        """End the line that is overwritten."""
        if self._in_place:
            self._outlet.put("\n")

    def _line(self, row: GapRow) -> str:
        rate_hz = self._session.cadence.rate_hz
        rate = "" if rate_hz is None else f"  {rate_hz:.2f} Hz"
        dropped = self._session.cadence.missing + self._session.capture.overflowed
        exposure = self._session.exposure.words
        if row.gap_mm is None or row.u_random_mm is None:
            gap = "no gap"
        else:
            u_mm = row.u_random_mm if row.u_gap_mm is None else row.u_gap_mm
            gap = f"gap {row.gap_mm:.4f} mm, U {2e3 * u_mm:.2f} µm"
        return f"{gap}  {row.status.value}{rate}  {dropped} dropped{'  ' + exposure if exposure else ''}"


def told(message: Message, outlet: Outlet, *, in_place: bool) -> None:
    """Print a message of the live measurement on the terminal."""
    # The message overwrites the status line, and the ^C that a terminal shows.
    outlet.put(f"{CLEARED if in_place else ''}fingervision: {message.words}\n")


@dataclass(frozen=True, slots=True)
class Showing:
    """Output of the live view: browser page or terminal.

    Parameters
    ----------
    page : bool
        Whether the live view is shown in a browser page.
    json_lines : bool
        Whether one line of JSON per frame is written to standard output.
    way : Access
        Settings for access to the page.
    record : bool
        Whether a run is recorded from the first frame.
    browser : bool
        Whether the page is opened in the browser automatically if the program runs in a terminal.
    """

    page: bool
    json_lines: bool
    way: Access
    record: bool
    browser: bool = True


def look_through(
    recording: Recorded,
    out: Path,
    showing: Showing,
    beside: Beside,
    gauges: Path | None = None,
    second: tuple[str, float | None, Choices] | None = None,
) -> None:
    """Show a recording in the browser page until the user ends it.

    Parameters
    ----------
    recording : Recorded
        The recording.
    out : Path
        Folder for files that the user saves.
    showing : Showing
        How the page is shown.
    beside : Beside
        The model, if there is one.
    gauges : Path or None
        A gauge file, whose panel is opened.
    second : (str, float or None, Choices) or None
        A second recording with its frame rate and the settings that the user chose, as for `beside_recording`.

    Raises
    ------
    FingervisionError
        The scale is for other frames, or the port is in use.
    """
    playback = Playback(recording, out)
    comparison = compared(playback, beside)
    if comparison is not None:
        playback.on_table = comparison.add_all
        playback.on_stop.append(comparison.stop)
    other = None if second is None else beside_recording(*second, playback)
    listening = bound(showing.way.host, showing.way.port)
    if gauges is not None:
        put_gauges_beside(playback, gauges, is_asked_for=True)
        words = "read, and saved to" if gauges.exists() else "a new file, written when they are saved"
        playback.say("gauges", f"Gauges: {gauges} ({words}).")
    page = Page(playback, listening, showing.way)
    with _printing(playback, showing) as (out_there, _), _until_signalled() as signalled:
        try:
            playback.start()
            if other is not None:
                other.start()
            _announce(page, out_there, browser=showing.browser)
            page.serve(signalled)
        finally:
            playback.stop()
    _end(playback)


def run(capture: Capture, choices: Choices, out: Path, showing: Showing, beside: Beside | None = None) -> None:
    """Run a live view until the user or the source ends it.

    Raises
    ------
    DeviceError
        The source ended without a frame, and there is no browser page.
    FingervisionError
        The scale is for other frames, or the port is in use.
    """
    try:
        session = Session(capture, choices, out)
        stand_beside(session, beside or Beside())
        # The port is bound before the camera is started, so that a port in use is reported at once.
        page = Page(session, bound(showing.way.host, showing.way.port), showing.way) if showing.page else None
    except BaseException:
        capture.source.close()
        raise
    remove_leftovers(out)
    with _printing(session, showing) as (out_there, said):
        lines = JsonLines(out_there) if showing.json_lines else None
        status = (
            StatusLine(session, out_there, in_place=is_terminal(sys.stdout)) if page is None and lines is None else None
        )
        for listener in (lines, status):
            if listener is not None:
                session.on_row.append(session.supervisor.guarded("Printing the rows", listener.add))
        with _until_signalled() as signalled:
            try:
                if showing.record:
                    session.record()
                session.start()
                if page is None:
                    while not (signalled.wait(0.1) or session.ended.is_set() or out_there.broken):
                        pass
                else:
                    _announce(page, out_there if lines is None else said, browser=showing.browser)
                    page.serve(signalled)
            finally:
                session.stop()
                comparison = session.features.get("model")
                if comparison is not None:
                    comparison.stop()
                if status is not None:
                    status.end()
    if page is None and not session.history.count and session.ended.is_set() and not session.supervisor.trouble:
        raise DeviceError(f"{session.description.name} gave no frame: check the source.")
    _end(session)


@contextmanager
def _printing(view: Session | Playback, showing: Showing) -> Iterator[tuple[Outlet, Outlet]]:
    """Print the messages of a view on standard error; yield the outlets of standard output and of standard error."""
    out_there, said = Outlet(sys.stdout, view.supervisor), Outlet(sys.stderr, view.supervisor)
    in_place = is_terminal(sys.stderr)
    if showing.page and showing.way.warning:
        view.say("network", showing.way.warning)
    view.on_message.append(lambda message: told(message, said, in_place=in_place))
    for message in tuple(view.messages):
        told(message, said, in_place=in_place)
    try:
        yield out_there, said
    finally:
        broken = out_there.broken
        out_there.close()
        if out_there.left_out:
            view.say(
                "left_out",
                f"{out_there.left_out} lines were not printed, because the reader of standard output was too slow.",
            )
        elif broken:
            view.say("unread", "Standard output was closed by the reading program: the live view has ended.")
        said.close()


def _end(view: Session | Playback) -> None:
    """End the program with the exit code of what could not be done, if a part of the view has failed."""
    if view.supervisor.trouble:
        raise SystemExit(int(ExitCode.COULD_NOT))


def _announce(page: Page, outlet: Outlet, *, browser: bool) -> None:
    outlet.put(f"The live view is at {page.address}  (Ctrl-C ends it)\n")
    outlet.put(f"Address for viewers, who cannot change anything: {page.viewer_address}\n")
    if browser and is_terminal(sys.stdout):
        # Every user of this computer can read command lines, so that the browser is given a file which only this user
        # can read.
        webbrowser.open(page.door().as_uri())


def is_terminal(stream: TextIO | None) -> bool:
    """Whether a stream is an interactive terminal; a closed stream is not."""
    try:
        return stream is not None and stream.isatty()
    except ValueError:
        return False


@contextmanager
def _until_signalled() -> Iterator[Event]:
    """Convert Ctrl-C and SIGTERM to an event, so that recordings are ended properly."""
    signalled = Event()

    def note(number: int, frame: FrameType | None) -> None:
        signalled.set()

    before = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield signalled
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
