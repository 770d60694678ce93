"""One supervisor: an error in any thread or task becomes an alarm, nothing stays green, and the rest goes on."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from calib.calibration import BareScale
from fingervision.cli import cli
from fingervision.domain.errors import OutputError
from fingervision.frames.source import Wish
from fingervision.interface.examples import copy_example
from fingervision.live import preview
from fingervision.live import recorder as recorder_module
from fingervision.live.choices import Choices
from fingervision.live.commands import measuring
from fingervision.live.comparison.comparison import Comparison
from fingervision.live.opening import opened as opened_source
from fingervision.live.page_words import page_json
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import recorded
from fingervision.live.server import Page
from fingervision.live.session import Session
from fingervision.live.supervisor import Supervisor
from tests.live.browser import browser, opened, shown
from tests.live.conftest import serving
from tests.live.test_attacks import closing_code, reply, socket_of
from tests.waiting import until

__all__ = ["browser", "opened"]


def broken(*_: object) -> Any:
    raise KeyError("a fault of ours")


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    found = Session(opened_source("simulated", Wish()), Choices(scale=BareScale(34.0)), tmp_path / "out")
    yield found
    found.stop()


def test_an_error_is_told_once_and_ends_with_the_next_success() -> None:
    said: list[tuple[str, str]] = []
    supervisor = Supervisor(lambda *message: said.append(message))
    ended: list[str] = []
    supervisor.start("Counting", broken, ended.append).join()
    assert "Counting has failed (KeyError: 'a fault of ours')" in supervisor.trouble
    assert ended == [supervisor.trouble]
    for _ in range(3):
        with supervisor.watching("Drawing"):
            raise OutputError("The disk is full.")
    assert [words for _, words in said] == [ended[0], "The disk is full."]
    assert supervisor.trouble == f"{ended[0]} The disk is full."
    with supervisor.watching("Drawing"):
        pass
    assert supervisor.trouble == ended[0]
    supervisor.start("Counting", lambda: None).join()
    assert supervisor.trouble == ""
    calls: list[int] = []
    guarded = supervisor.guarded("Adding", lambda number: calls.append(number) or 1 / 0)
    for number in range(3):
        guarded(number)
    assert calls == [0]
    assert "ZeroDivisionError" in supervisor.trouble


def test_a_part_that_fails_is_an_alarm_and_measuring_goes_on(session: Session) -> None:
    session.on_row.append(session.supervisor.guarded("Comparing with the model", broken))
    session.start()
    until(lambda: session.history.count > 5)
    assert "Comparing with the model has failed" in head_of(session)["state"]["trouble"]
    assert not session.ended.is_set()


@pytest.mark.parametrize(
    ("module", "name"), [(preview, "section"), (preview, "coded"), (preview, "_now"), (Session, "state")]
)
def test_a_page_is_told_of_an_error_in_what_it_is_sent(
    module: Any, name: str, session: Session, page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, name, broken)
    session.start()
    until(lambda: session.history.count > 2)
    with suppress(TimeoutError), socket_of(page.address) as socket:
        until(lambda: "a fault of ours" in str(received(socket)["state"]["trouble"]))
    assert session.supervisor.trouble


def received(socket: Any) -> Any:
    while isinstance(got := socket.recv(timeout=10.0), str):
        pass
    socket.send('{"do": "ack"}')
    return json.loads(got[4 : 4 + int.from_bytes(got[:4], "big")])


def head_of(view: Session | Playback) -> Any:
    preview.state_has_changed()
    content = preview.message(view, preview.Known(), None).content
    return json.loads(content[4 : 4 + int.from_bytes(content[:4], "big")])


def test_a_request_that_fails_is_answered_and_the_connection_remains(
    session: Session, page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = measuring.stated_scale
    monkeypatch.setattr(measuring, "stated_scale", broken)
    with socket_of(page.address) as socket:
        assert "KeyError" in reply(socket, {"do": "scale", "px_per_mm": 34})["refused"]
        assert "KeyError" in session.supervisor.trouble
        monkeypatch.setattr(measuring, "stated_scale", before)
        assert "refused" not in reply(socket, {"do": "scale", "px_per_mm": 34})
        assert session.supervisor.trouble == ""


def test_a_binary_message_is_refused_with_its_code(session: Session, page: Page) -> None:
    with socket_of(page.address) as socket:
        socket.send(b"\x00\x01")
        assert closing_code(socket) == 1003
    assert not session.supervisor.trouble
    assert not list(session.messages)


def test_a_number_with_a_comma_is_understood_or_asked_about(session: Session, page: Page) -> None:
    with socket_of(page.address) as socket:
        assert "refused" not in reply(socket, {"do": "scale", "px_per_mm": "34,5"})
        assert session.choices.scale is not None
        assert session.choices.scale.px_per_mm == 34.5
        assert "1.234 or 1234" in reply(socket, {"do": "height", "below_tip_mm": "1,234"})["refused"]
        asked = reply(socket, {"do": "scale", "px_per_mm": "345"})
        assert all(fact in asked["question"] for fact in ("34.5 px/mm", "345 px/mm", "0.1"))
        assert session.choices.scale.px_per_mm == 34.5
        assert "question" not in reply(socket, asked["request"])
        assert session.choices.scale.px_per_mm == 345.0
        assert "question" not in reply(socket, {"do": "scale", "px_per_mm": 200})


@pytest.mark.parametrize("request_", [{"do": "height", "below_tip_mm": 0}, {"do": "scale", "px_per_mm": -1}])
def test_no_answer_names_an_option_of_the_command_line(session: Session, page: Page, request_: dict[str, Any]) -> None:
    with socket_of(page.address) as socket:
        assert "--" not in reply(socket, request_)["refused"]


def test_options_in_a_sentence_become_words_of_the_page() -> None:
    words = 'The folder "a--b" is full: name another folder with --out, or run `fingervision live --out DIR`.'
    assert json.loads(page_json(words)) == words.replace(" with --out,", " at the next start,")


@pytest.mark.parametrize(("is_busy", "what"), [(True, "The processor is"), (False, "The disk of")])
def test_a_recording_that_is_too_slow_names_the_bottleneck(
    is_busy: bool, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "FRAMES_WAITING", 10)
    monkeypatch.setattr(recorder_module, "FRAMES_UNTIL_HURRY", 2)

    def work(*_: object) -> None:
        end_s = time.thread_time() + 0.05
        while is_busy and time.thread_time() < end_s:
            pass
        if not is_busy:
            time.sleep(0.05)

    run = SimpleNamespace(path=tmp_path, is_there=True, frames=0, measured=0, event=work, close=lambda _: None)
    recorder = recorder_module.Recorder(run, Supervisor(lambda *_: None))  # type: ignore[arg-type]
    until(lambda: recorder.add(("name", "words")) or time.sleep(0.01) or recorder.failure)
    assert recorder.failure.startswith(what)
    with suppress(OutputError):
        recorder.stop()


@pytest.mark.parametrize("goes_on", [True, False])
def test_what_waits_when_a_recording_stops_is_finished_as_long_as_it_goes_on(
    *, goes_on: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "PATIENCE_S", 0.5)
    monkeypatch.setattr(recorder_module, "LEARNING_S", 5.0)
    run = SimpleNamespace(path=tmp_path, is_there=True, frames=0, measured=0, event=lambda *_: None)

    def measure(_: str) -> None:
        time.sleep(1.0)  # the camera is learnt
        run.measured = 1
        for _ in range(9):
            time.sleep(0.2)
            run.measured += goes_on

    run.close = measure
    recorder = recorder_module.Recorder(run, Supervisor(lambda *_: None))  # type: ignore[arg-type]
    if goes_on:
        recorder.stop()
        assert run.measured == 10
    else:
        with pytest.raises(OutputError, match="too slow"):
            recorder.stop()


def test_an_interrupt_while_starting_is_one_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("fingervision.live.running.stand_beside", interrupted)
    result = CliRunner().invoke(cli, ["live", "simulated", "--port", "0", "--out", str(tmp_path)])
    assert result.exit_code == 1
    assert "Abort" not in result.output
    assert result.output.count("\n") == 1


# ---- real faults, in a browser
@pytest.fixture
def playback(tmp_path: Path) -> Iterator[Playback]:
    """The example of a recording with its drive log, compared with a model."""
    folder = tmp_path / "example"
    copy_example("measure", folder)
    (folder / "model.csv").write_text("input_mm,gap_mm\n-1,2\n3,15\n")
    choices = Choices(scale=BareScale(34.0))
    drive = ("--drive", str(folder / "drive.csv"), "--drive-offset-s", "0")
    view = Playback(recorded(str(folder / "opening.mp4"), None, choices, drive), tmp_path / "out")
    comparison = Comparison(view, folder / "model.csv")
    view.features["model"] = comparison
    view.on_table = comparison.add_all
    yield view
    view.stop()
    comparison.stop()


def table_rewritten(view: Playback) -> None:
    """Nothing has to be done: `measure --drive` itself rewrites its table wider at the end."""


def table_deleted(view: Playback) -> None:
    track = view._track
    assert track is not None
    while not track.is_whole and not track.failure:
        track.table.unlink(missing_ok=True)
        time.sleep(0.01)


def model_broken(view: Playback) -> None:
    path = view.features["model"].path
    path.write_text("input_mm,gap_mm\n")


def recording_truncated(view: Playback) -> None:
    until(lambda: view.row_count > 200, within_s=600.0)  # frame 200 has a row that says ok
    path = Path(view.recorded.name)
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size // 4)
    view.seek(200)


def playing_failed(view: Playback) -> None:
    view._advance = broken  # type: ignore[method-assign]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "is_healthy"),
    [
        (table_rewritten, True),
        (table_deleted, False),
        (model_broken, False),
        (recording_truncated, False),
        (playing_failed, False),
    ],
    ids=lambda each: getattr(each, "__name__", ""),
)
def test_no_fault_looks_healthy(
    fault: Callable[[Playback], None], is_healthy: bool, playback: Playback, opened: Callable[..., Any]
) -> None:
    green = "getComputedStyle(document.querySelector('#status')).color === 'rgb(10, 112, 56)'"
    playback.start()
    if fault is table_deleted:  # before it is whole
        fault(playback)
    with serving(playback) as page:
        seen = opened(page.address)
        if fault is not table_deleted:
            shown(seen, f"document.querySelector('#status').textContent === 'ok' && {green}")
            fault(playback)
        if is_healthy:
            shown(seen, "/ 300 samples/.test(document.querySelector('#model_words').textContent)")
            assert seen.locator("#alarm").is_hidden()
            assert not playback.supervisor.trouble
        else:
            shown(seen, "!document.querySelector('#alarm').hidden")
            shown(seen, f"!({green})")
            assert playback.supervisor.trouble in seen.inner_text("#alarm")
            assert any(each.words in playback.supervisor.trouble for each in playback.messages)
        seen.close()
