"""Operation of a live view: measurement, browser page or terminal, and an orderly end at any signal."""

import signal
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from types import FrameType
from typing import TextIO

from fingervision.domain.errors import DeviceError, ExitCode
from fingervision.live.access import Access
from fingervision.live.beside import Beside, stand_beside
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.comparison.comparison import Comparison
from fingervision.live.outlet import Outlet
from fingervision.live.playback.gauges_beside import put_gauges_beside
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import Recorded
from fingervision.live.run_folder import remove_leftovers
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.live.terminal import JsonLines, StatusLine, told


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


def look_through(recording: Recorded, out: Path, showing: Showing, beside: Beside, gauges: Path | None = None) -> None:
    """Show a recording in the browser page until the user ends it; `gauges` names a gauge file and opens its panel.

    Raises
    ------
    FingervisionError
        The scale is for other frames, or the port is in use.
    """
    playback = Playback(recording, out)
    comparison = None if beside.model is None else Comparison(playback, beside.model, beside.kind)
    if comparison is not None:
        playback.features["model"] = comparison
        playback.on_table = comparison.add_all
        playback.on_stop.append(comparison.stop)
    listening = bound(showing.way.host, showing.way.port)
    if gauges is not None:
        put_gauges_beside(playback, gauges, is_asked_for=True)
        words = "read, and saved to" if gauges.exists() else "a new file, written when they are saved"
        playback.say("gauges", f"Gauges: {gauges} ({words}).")
    page = Page(playback, listening, showing.way)
    with _printing(playback, showing) as (out_there, _), _until_signalled() as signalled:
        try:
            playback.start()
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
                if isinstance(comparison, Comparison):
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
