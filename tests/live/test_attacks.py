"""Attacks by strangers, foreign pages or faulty pages: each test fails if the corresponding protection is missing."""

import json
import re
import struct
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from socket import SO_LINGER, SOL_SOCKET, create_connection
from threading import Event, Thread
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from calib.calibration import BareScale
from fingervision.frames.source import Wish
from fingervision.live import server
from fingervision.live.choices import Choices
from fingervision.live.opening import opened as opened_source
from fingervision.live.server import PAGE, Page, bound, files, index, kept_token
from fingervision.live.session import Session
from tests.live.browser import browser, opened, shown, typed
from tests.waiting import until

__all__ = ["browser", "opened"]
BRIEF_VISITS = 24


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    found = Session(opened_source("simulated", Wish()), Choices(scale=BareScale(34.0)), tmp_path)
    yield found
    found.capture.stop()


def status(address: str, **headers: str) -> int:
    try:
        with urlopen(Request(address, headers=headers), timeout=10.0) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def socket_of(address: str, **options: Any) -> ClientConnection:
    origin = address.partition("/?")[0]
    target = address.replace("http://", "ws://").replace("/?", "/socket?")
    return connect(target, **{"origin": origin, "max_size": None, **options})


def reply(socket: ClientConnection, request: Any) -> dict[str, Any]:
    """Return the answer to a request, and acknowledge pictures that arrive before the answer."""
    socket.send(request if isinstance(request, str | bytes) else json.dumps(request))
    while True:
        got = socket.recv(timeout=10.0)
        if isinstance(got, str):
            return dict(json.loads(got))
        socket.send('{"do": "ack"}')


def closing_code(socket: ClientConnection) -> int:
    """Wait until the server closes a socket, and return the close code."""
    with suppress(ConnectionClosed):
        while True:
            socket.recv(timeout=10.0)
    return socket.close_code or 0


def parts(address: str) -> tuple[str, str]:
    origin, _, token = address.partition("/?token=")
    return origin, token


def test_a_name_that_is_pointed_here_is_not_served(page: Page) -> None:
    for host in ("evil.example", "127.0.0.1.evil.example", "127.0.0.1", "127.0.0.1:1", "", "[::ffff:7f00:1]:80"):
        assert status(page.address, Host=host) == 400
    with pytest.raises(InvalidStatus):
        socket_of(page.address, additional_headers={"Host": "evil.example"})


def test_a_foreign_page_opens_no_socket(page: Page) -> None:
    origin, _ = parts(page.address)
    for foreign in ("http://evil.example", "null", origin.replace("http", "https"), origin + "0", None, "file://"):
        with pytest.raises(InvalidStatus) as refused:
            socket_of(page.address, origin=foreign)
        assert refused.value.response.status_code == 403
    assert status(page.address, Origin="http://evil.example") == 403


def test_missing_stale_and_guessed_tokens_are_refused(page: Page, session: Session, tmp_path: Path) -> None:
    origin, token = parts(page.address)
    (session.out / ".live_token").unlink()
    other = Page(session, bound("127.0.0.1", 0))
    stale = parts(other.address)[1]
    guesses = ("", "x", token[:-1], token + "x", token.swapcase(), stale, "%00", "a" * 4000)
    for path in ("/", "/gaps.csv", "/steps/0.png", "/nothing"):
        for guess in guesses:
            assert status(f"{origin}{path}?token={guess}") == 403
        assert status(f"{origin}{path}") == 403
    for guess in guesses[:6]:
        with pytest.raises(InvalidStatus):
            socket_of(f"{origin}/?token={guess}")
    other._listening.close()


def test_the_token_is_in_no_log_file_and_no_referrer(capfd: Any, page: Page, session: Session) -> None:
    # What is printed is caught before the server is made, which looks then for where to log.
    origin, token = parts(page.address)
    with urlopen(page.address) as answer:
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert token not in answer.read().decode()
    with socket_of(page.address) as socket:
        head = b""
        while not head:
            got = socket.recv(timeout=10.0)
            head = got if isinstance(got, bytes) else b""
        assert token.encode() not in head
        assert token not in json.dumps(reply(socket, {"do": "nothing"}))
    status(f"{origin}/missing?token={token}")
    printed = capfd.readouterr()
    assert token not in printed.out + printed.err
    for file in session.out.rglob("*"):
        if file.is_file() and file.name not in (".live_token", ".live_viewer_token", ".live_page.html"):
            assert token.encode() not in file.read_bytes()
    assert not any(token in each.words for each in session.messages)


def test_a_token_is_its_users_alone_and_one_that_others_could_read_is_not_taken_again(
    page: Page, session: Session
) -> None:
    names = (".live_token", ".live_viewer_token")
    for name in names:
        assert (session.out / name).stat().st_mode & 0o077 == 0
    before = [(session.out / name).read_text() for name in names]
    assert [kept_token(session.out, name) + "\n" for name in names] == before
    (session.out / names[0]).chmod(0o644)
    assert kept_token(session.out, names[0]) + "\n" != before[0]
    assert (session.out / names[0]).stat().st_mode & 0o077 == 0


def test_pages_and_connections_are_limited(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "PAGES_AT_ONCE", 1)
    monkeypatch.setattr(server, "CONNECTIONS_AT_ONCE", 4)
    ending = Event()
    page = Page(session, bound("127.0.0.1", 0))
    thread = Thread(target=page.serve, args=(ending,))
    thread.start()
    try:
        with socket_of(page.address) as first:
            with socket_of(page.address) as second:
                assert closing_code(second) == 1013
            assert "refused" in reply(first, {"do": "nothing"})
            port = int(page.address.split(":")[2].split("/")[0])
            head = f"GET /?token=x HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
            held = [create_connection(("127.0.0.1", port), timeout=10.0) for _ in range(4)]
            for each in held:
                each.sendall(head)
            assert any(b" 503 " in each.recv(100) for each in held)
            for each in held:
                each.close()
    finally:
        ending.set()
        thread.join()


def test_viewers_who_stay_a_millisecond_leave_nothing_behind(page: Page, session: Session) -> None:
    said = len(session.messages)
    port = int(page.address.split(":")[2].split("/")[0])
    with socket_of(page.address) as quiet:
        assert "refused" not in reply(quiet, {"do": "height", "below_tip_mm": 0.4})
        for number in range(BRIEF_VISITS):
            with socket_of(page.viewer_address if number % 2 else page.address) as brief:
                if number % 3 == 0:
                    brief.send('{"do": "ack"}')
                if number % 4 == 0:  # cut off, without a word
                    brief.socket.setsockopt(SOL_SOCKET, SO_LINGER, struct.pack("ii", 1, 0))
                    brief.socket.close()
            with create_connection(("127.0.0.1", port), timeout=10.0) as half:
                half.sendall(b"GET /socket?token=x HTTP/1.1\r\nHost: "[: 5 + number % 30])
                half.setsockopt(SOL_SOCKET, SO_LINGER, struct.pack("ii", 1, 0))
        until(lambda: len(page._sockets) <= 1, lambda: "sockets of viewers who have gone are kept", within_s=10.0)
        # Who worked the view still does, and is told nothing of them.
        assert "refused" not in reply(quiet, {"do": "height", "below_tip_mm": 0.3})
    assert [each.words for each in session.messages][said:] == []
    assert status(page.address) == 200


def test_no_name_leads_out_of_the_pages_folder(page: Page) -> None:
    origin, token = parts(page.address)
    for name in (
        "..%2f..%2fsession.py",
        "../session.py",
        "..%5csession.py",
        "%2e%2e/server.py",
        "%2fetc%2fpasswd",
        "index.html%00.js",
        "live.js%2f..%2f..%2fserver.py",
        ".",
        "",
    ):
        assert status(f"{origin}/page/{name}?token={token}") in (404, 403)
    for number in ("..%2f0", "-1", "1e3", "0%00", "/etc/passwd", "9" * 300):
        assert status(f"{origin}/steps/{number}.png?token={token}") in (404, 403)
    assert all((PAGE / name).parent == PAGE for name in files())


def test_malformed_messages_are_refused_and_the_page_lives_on(page: Page) -> None:
    with socket_of(page.address) as socket:
        for words in (
            "", "{", "null", "[]", '"do"', "[" * 4000, '{"do": null}', '{"do": ["record"]}', '{"do": {"a": 1}}',
            '{"do": "__class__"}', '{"do": "' + "x" * 3000 + '"}', '{"do": "region", "box": [1e999, 0, 0, 0]}',
            '{"do": "height", "below_tip_mm": "<script>"}',
            "\x00\x01\x02", '{"do":"tips","tips":"../up"}', '{"do":"calibrate","kind":"bar","box":[0,0,1]}',
        ):  # fmt: skip
            assert "refused" in reply(socket, words), words
    with socket_of(page.address) as socket:
        socket.send(b"\x00" * 10)
        closing_code(socket)
    assert status(page.address) == 200


def test_an_oversized_message_and_a_flood_close_the_socket_and_nothing_else(page: Page) -> None:
    with socket_of(page.address) as quiet:
        with socket_of(page.address) as socket:
            socket.send("x" * 5000)
            assert closing_code(socket) == 1009
        with socket_of(page.address) as socket:
            with suppress(ConnectionClosed):
                for _ in range(400):
                    socket.send('{"do": "ack"}')
            assert closing_code(socket) == 1008
        assert "refused" in reply(quiet, {"do": "nothing"})


def test_who_only_looks_changes_nothing_and_may_stop_a_motor(page: Page, session: Session) -> None:
    with socket_of(page.viewer_address) as viewer:
        for name in ("record", "zero", "scale", "region", "calibrate", "bed_move", "take_over", "snapshot", "measure"):
            assert "you can only watch" in reply(viewer, {"do": name, "px_per_mm": 3.0})["refused"]
        assert session.choices.scale == BareScale(34.0)
        # The live view has no test bed; that is another refusal.
        assert "no test bed" in reply(viewer, {"do": "bed_stop"})["refused"]


def test_one_page_writes_until_another_takes_over(page: Page, session: Session) -> None:
    with socket_of(page.address) as first, socket_of(page.address) as second:
        assert "refused" not in reply(first, {"do": "scale", "px_per_mm": 10.0})
        assert "Take over" in reply(second, {"do": "scale", "px_per_mm": 20.0})["refused"]
        assert "refused" not in reply(second, {"do": "take_over"})
        assert "refused" not in reply(second, {"do": "scale", "px_per_mm": 20.0})
        assert "Take over" in reply(first, {"do": "scale", "px_per_mm": 30.0})["refused"]
        assert session.choices.scale == BareScale(20.0)
        second.close()
        until(lambda: "refused" not in reply(first, {"do": "scale", "px_per_mm": 40.0}), within_s=10.0)


def test_the_page_has_no_script_of_its_own_and_the_policy_lets_none_in() -> None:
    from fingervision.live.guard import POLICY

    scripts = re.findall(r"<script([^>]*)>(.*?)</script>", index(), re.S)
    assert scripts
    assert all("src=" in attributes and not body.strip() for attributes, body in scripts)
    assert not re.search(r"\son\w+\s*=|javascript:|\sstyle\s*=", index())
    assert "unsafe" not in POLICY
    stated = dict(part.strip().split(" ", 1) for part in POLICY.split(";"))
    assert stated == {
        "default-src": "'none'",
        "script-src": "'self'",
        "style-src": "'self'",
        "img-src": "'self' blob:",
        "connect-src": "'self'",
        # These three do not fall back to default-src (W3C, Content Security Policy Level 3, 6).
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    for name in files():
        if name.endswith(".js") and name != "uPlot.iife.min.js":
            source = (PAGE / name).read_text(encoding="utf-8")
            assert not re.search(r"\beval\(|new Function|document\.write|https?://", source), name
            # What comes from elsewhere is set as text: markup is the page's own, whole and constant.
            for made in re.findall(r"innerHTML = (`[^`]*`|'[^']*'|[^;]+);", source):
                assert "${" not in made, (name, made)


@pytest.mark.slow
def test_markup_in_a_name_is_text(live: Callable[..., Any], opened: Callable[..., Any], tmp_path: Path) -> None:
    import cv2
    import numpy as np

    folder = tmp_path / "<img src=x onerror=document.title='got'><script>document.title='got'<"
    folder.mkdir()
    for number in range(3):
        cv2.imwrite(str(folder / f"{number}.png"), np.full((240, 320), 200, np.uint8))
    page = opened(live(folder, "--rate-hz", "10", "--port", "0").address)
    shown(page, "document.querySelector('#source').textContent.includes('<script>')")
    typed(page, "#px_per_mm", "10")
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 0")
    assert page.title() == "fingervision live"
    assert page.locator("#source *").count() == 0
    assert page.evaluate("document.querySelectorAll('img[src=x], #log script').length") == 0
