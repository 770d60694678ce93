"""The measurement never waits: paused readers, silent pages, and an outdated zero are detected."""

import io
import json
import shutil
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from calib.calibration import BareScale
from fingervision.domain.errors import OutputError, StateError
from fingervision.domain.frame import Frame
from fingervision.domain.status import Status
from fingervision.frames.source import Wish
from fingervision.live import capture as capture_module
from fingervision.live import page_socket, server
from fingervision.live import recorder as recorder_module
from fingervision.live.cadence import Cadence
from fingervision.live.capture import OverflowReport
from fingervision.live.frame_measurement import Seen
from fingervision.live.opening import opened
from fingervision.live.preview import Known, message, state_has_changed
from fingervision.live.recorder import minutes_left
from fingervision.live.running import JsonLines, Outlet
from fingervision.live.session import Session
from fingervision.live.supervisor import Supervisor
from fingervision.storage.gaps_csv import GapRow
from tests.waiting import until

HAMMERED_S = 0.5


def head_of(session: Session) -> dict[str, Any]:
    state_has_changed()  # what pages are told is composed for all of them at once
    content = message(session, Known(), None).content
    (length,) = struct.unpack(">I", content[:4])
    head: dict[str, Any] = json.loads(content[4 : 4 + length])
    return head


class Unread(io.StringIO):
    """An output stream whose reader pauses until the test continues it."""

    def __init__(self) -> None:
        super().__init__()
        self.goes_on = Event()

    def write(self, text: str) -> int:
        self.goes_on.wait()
        return super().write(text)


class Gone(io.StringIO):
    """An output stream without a reader."""

    def write(self, text: str) -> int:
        raise BrokenPipeError


def test_a_reader_that_pauses_costs_no_frame_of_measurement_or_recording(
    session: Session, rows: Callable[[Path], list[dict[str, str]]]
) -> None:
    stream = Unread()
    outlet = Outlet(stream, Supervisor(lambda *_: None))
    session.on_row.append(JsonLines(outlet).add)
    run = session.record()
    session.start()
    until(lambda: session.history.count >= 30)
    session.stop()
    assert [int(row["frame"]) for row in rows(run / "gaps.csv")] == list(range(session.history.count))
    stream.goes_on.set()
    outlet.close()
    assert len(stream.getvalue().splitlines()) == session.history.count


def test_printing_to_a_reader_that_does_not_read_never_waits_and_counts_what_it_leaves_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("fingervision.live.running.PATIENCE_S", 0.2)
    stream = Unread()
    outlet = Outlet(stream, Supervisor(lambda *_: None), waiting=10)
    began_s = time.monotonic()
    for _ in range(200):
        outlet.put("line\n")
    assert time.monotonic() - began_s < 1.0
    outlet.close()
    assert time.monotonic() - began_s < 2.2
    assert outlet.left_out >= 199
    stream.goes_on.set()


def test_a_reader_that_is_gone_is_noticed() -> None:
    outlet = Outlet(Gone(), Supervisor(lambda *_: None))
    outlet.put("line\n")
    outlet.close()
    assert outlet.broken


def test_rate_and_jitter_can_be_asked_for_while_frames_come() -> None:
    cadence, ending, before = Cadence(), Event(), sys.getswitchinterval()

    def come() -> None:
        time_s = 0.0
        while not ending.is_set():
            cadence.add(time_s := time_s + 0.005)

    sys.setswitchinterval(1e-6)
    thread = Thread(target=come)
    thread.start()
    try:
        until_s = time.monotonic() + HAMMERED_S
        while time.monotonic() < until_s:
            assert (cadence.jitter_s or 0.0) >= 0.0
            assert (cadence.rate_hz or 1.0) > 0.0
    finally:
        ending.set()
        thread.join()
        sys.setswitchinterval(before)


def closing_code(page: server.Page) -> int | None:
    """Open the page's socket without sending anything, until the server closes it."""
    address = page.address.replace("http://", "ws://").replace("/?", "/socket?")
    origin = page.address.partition("/?")[0]
    with connect(address, origin=origin) as socket:  # type: ignore[arg-type]
        try:
            while True:
                socket.recv(timeout=5.0)
        except ConnectionClosed as closed:
            return None if closed.rcvd is None else closed.rcvd.code


def test_a_fault_in_sending_closes_the_socket_so_that_the_page_connects_again(
    page: server.Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("a fault of ours")

    monkeypatch.setattr(page_socket, "message", fail)
    assert closing_code(page) == page_socket.TRY_AGAIN_LATER


def test_a_page_that_is_silent_is_let_go(page: server.Page, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page_socket, "ACKNOWLEDGED_WITHIN_S", 0.2)
    assert closing_code(page) == page_socket.TRY_AGAIN_LATER


def test_a_zero_does_not_outlive_the_scale_that_it_was_taken_with(session: Session) -> None:
    session.choose(zero_mm=1.25)
    session.choose(least_mm=0.1)
    assert session.choices.zero_mm == 1.25
    session.choose(scale=BareScale(20.0))
    assert session.choices.zero_mm == 0.0
    assert session.messages[-1].words.startswith("The zero was removed")


def test_a_zeroed_value_and_its_tolerance_agree(session: Session) -> None:
    frame = Frame(np.zeros((480, 640), np.uint8), 0, 0.0)
    row = GapRow(0, 0.0, Status.OK, gap_mm=5.0, u_random_mm=0.001)
    session.seen = Seen(frame, None, row)
    session.choose(zero_mm=4.0, least_mm=0.5, greatest_mm=1.5)
    head = head_of(session)
    assert head["now"]["verdict"] == "pass"
    assert head["state"]["zero_mm"] == head["now"]["zero_mm"] == 4.0


def test_nothing_is_recorded_after_the_source_has_ended(session: Session, tmp_path: Path) -> None:
    session.ended.set()
    with pytest.raises(StateError, match="source has ended"):
        session.record()
    assert list(tmp_path.iterdir()) == []


def test_a_recording_that_failed_is_told_until_the_next_one(session: Session) -> None:
    session.record()
    recorder = session.recording
    assert recorder is not None
    recorder.fail("the disk is full")
    session.start()
    until(lambda: session.supervisor.trouble)
    assert "the disk is full" in head_of(session)["state"]["trouble"]
    session.record()
    assert head_of(session)["state"]["trouble"] == ""
    session.stop()


def test_a_folder_that_is_taken_away_ends_the_recording_with_a_sentence(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "DISK_EVERY_S", 0.1)
    run = session.record()
    session.start()
    until(lambda: session.history.count >= 5)
    away = run.with_name("away")
    run.rename(away)
    until(lambda: session.supervisor.trouble)
    assert str(run) in session.supervisor.trouble
    assert "is gone" in session.supervisor.trouble
    measured = session.history.count
    until(lambda: session.history.count >= measured + 5)
    session.stop()
    # What was written until then is whole.
    assert len((away / "gaps.csv").read_text().splitlines()) >= 5
    assert (away / "video.mp4").stat().st_size > 0


def test_the_room_left_is_that_of_the_disk_at_the_rate_so_far(tmp_path: Path) -> None:
    (tmp_path / "video.mp4").write_bytes(b"\0" * 3_000_000)
    free = shutil.disk_usage(tmp_path).free
    assert minutes_left(tmp_path, 30.0) == pytest.approx(free / 100_000 / 60.0, rel=0.05)
    assert minutes_left(tmp_path, 1.0) is None
    assert minutes_left(tmp_path / "missing", 30.0) is None


def test_frames_that_nobody_measures_hold_up_no_capture_and_are_counted_and_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(capture_module, "FRAMES_WAITING", 3)
    capture = opened("simulated", Wish())
    capture.start(Supervisor(lambda *_: None))
    capture.begin()
    # Seven frames take 0.3 s; with a wait of 5 s for each there is not time for three.
    until(lambda: capture.overflowed >= 4, within_s=12.0)
    lost = capture.overflowed
    capture.stop()
    lost = capture.overflowed
    said: list[tuple[str, str]] = []
    OverflowReport(capture, lambda name, words: said.append((name, words))).say()
    assert said == [("overflowed", f"{lost} frames are lost, because they arrived faster than they could be measured.")]


def test_a_disk_that_stands_still_holds_up_nobody_and_ends_the_recording_with_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "FRAMES_WAITING", 3)
    goes_on = Event()
    run = SimpleNamespace(
        path=tmp_path, is_there=True, frames=0, measured=0, event=lambda *_: goes_on.wait(), close=lambda _: None
    )
    recorder = recorder_module.Recorder(run, Supervisor(lambda *_: None))  # type: ignore[arg-type]
    thread = Thread(target=lambda: [recorder.add(("name", "words")) for _ in range(10)], daemon=True)
    thread.start()
    thread.join(5.0)
    assert not thread.is_alive()
    assert "is too slow for this camera" in recorder.failure
    goes_on.set()
    with pytest.raises(OutputError, match="too slow"):
        recorder.stop()


def test_a_fault_of_ours_in_measuring_is_seen_and_ends_the_view(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("a fault of ours")

    monkeypatch.setattr(session, "_take", fail)
    session.start()
    assert session.ended.wait(30.0)
    session.stop()
    assert "start the live view again" in head_of(session)["state"]["trouble"]
