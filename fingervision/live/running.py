"""A live view from its start to its end: measuring, the page or the terminal, and a clean end at any signal."""

import signal
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from types import FrameType

from fingervision.domain.errors import ExitCode, FingervisionError
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.live.terminal import JsonLines, StatusLine, told


@dataclass(frozen=True, slots=True)
class Showing:
    """Where the live view is shown.

    Parameters
    ----------
    page : bool
        In a browser.
    json_lines : bool
        One line a frame on standard output.
    host : str
        Address that the page is served at.
    port : int
        0 takes any free one.
    record : bool
        Whether a run is recorded from the first frame.
    """

    page: bool
    json_lines: bool
    host: str
    port: int
    record: bool


def run(capture: Capture, choices: Choices, out: Path, showing: Showing) -> None:
    """Run a live view until the user or the source ends it.

    Raises
    ------
    FingervisionError
        The scale is for other frames, the port is in use, or nothing could be measured to the end.
    """
    try:
        session = Session(capture, choices, out)
        # Before the camera runs: a port in use is said at once.
        page = Page(session, bound(showing.host, showing.port), showing.host) if showing.page else None
    except FingervisionError:
        capture.source.close()
        raise
    session.on_message.append(lambda message: told(message, sys.stderr))
    for message in tuple(session.messages):
        told(message, sys.stderr)
    lines = JsonLines(sys.stdout) if showing.json_lines else None
    status = StatusLine(session, sys.stdout) if page is None and lines is None else None
    for listener in (lines, status):
        if listener is not None:
            session.on_row.append(listener.add)
    if showing.record:
        session.record()
    with _until_signalled() as signalled:
        session.start()
        try:
            if page is None:
                while not (signalled.wait(0.1) or session.ended.is_set() or (lines is not None and lines.broken)):
                    pass
            else:
                _announce(page, on_stdout=lines is None)
                page.serve(signalled)
        finally:
            session.stop()
            if status is not None:
                status.end()
    if page is None and not session.history.count and session.ended.is_set():
        raise FingervisionError(f"{session.description.name} gave no frame: check the source.")
    failed = [message for message in session.messages if message.name in ("failed", "recording_failed")]
    if failed:
        raise SystemExit(int(ExitCode.COULD_NOT))


def _announce(page: Page, *, on_stdout: bool) -> None:
    stream = sys.stdout if on_stdout else sys.stderr
    stream.write(f"The live view is at {page.address}  (Ctrl-C ends it)\n")
    stream.flush()
    if sys.stdout.isatty():
        webbrowser.open(page.address)


@contextmanager
def _until_signalled() -> Iterator[Event]:
    """Turn Ctrl-C and a request to terminate into an event, so that recordings are ended properly."""
    signalled = Event()

    def note(number: int, frame: FrameType | None) -> None:
        signalled.set()

    before = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield signalled
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
