"""Access by strangers: idle connections, passwords in addresses, endless numbers, the token in other places."""

import socket
from pathlib import Path
from types import SimpleNamespace
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from fingervision.domain.errors import UsageError
from fingervision.frames.network_stream import without_password
from fingervision.live import guard, server
from fingervision.live.commands import obey
from fingervision.live.page_socket import known_by
from fingervision.live.preview import Known
from fingervision.live.session import Session

# More than the server takes connections at once.
IDLE, OPENED_WITHIN_S = server.CONNECTIONS_AT_ONCE + 12, 10.0


def status(address: str) -> int:
    try:
        with urlopen(address, timeout=OPENED_WITHIN_S) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def test_idle_connections_lock_nobody_out(page: server.Page, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "ASKS_WITHIN_S", 60.0)
    port = int(page.address.split(":")[2].split("/")[0])
    held = [socket.create_connection(("127.0.0.1", port)) for _ in range(IDLE)]
    held[0].sendall(b"GET / HT")
    assert status(page.address) == 200
    for each in held:
        each.close()


def test_every_answer_keeps_the_page_to_itself(page: server.Page) -> None:
    with urlopen(page.address, timeout=OPENED_WITHIN_S) as answer:
        headers = answer.headers
    assert "default-src 'none'; script-src 'self'" in headers["Content-Security-Policy"]
    assert "unsafe" not in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["X-Frame-Options"] == "DENY"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cache-Control"] == "no-store"
    assert headers["Cross-Origin-Opener-Policy"] == "same-origin"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"


def test_who_never_asks_is_let_go(page: server.Page, monkeypatch: pytest.MonkeyPatch) -> None:
    assert status(page.address) == 200
    monkeypatch.setattr(guard, "ASKS_WITHIN_S", 0.1)
    port = int(page.address.split(":")[2].split("/")[0])
    with socket.create_connection(("127.0.0.1", port), timeout=OPENED_WITHIN_S) as held:
        held.sendall(b"GET / HT")
        assert held.recv(1) == b""


def test_a_number_without_end_is_refused_and_no_fault(page: server.Page, session: Session) -> None:
    assert status(page.address.replace("/?", f"/steps/{'9' * 5000}.png?")) == 404
    for number in (10**400, 10**5000, float("inf"), float("nan"), True, "one"):
        with pytest.raises(UsageError):
            obey(session, {"do": "height", "below_tip_mm": number})
        with pytest.raises(UsageError):
            obey(session, {"do": "region", "box": [0, 0, 10, number]})
        with pytest.raises(UsageError):
            obey(session, {"do": number})


def test_a_page_that_comes_back_with_a_number_without_end_is_a_new_one() -> None:
    for number in ("9" * 5000, "-1", "1e3", "\u0663"):
        page = SimpleNamespace(query_params={"view": "one", "rows": number, "messages": "1"})
        assert known_by(page) == Known()  # type: ignore[arg-type]


def test_the_browser_is_opened_without_the_token_on_its_command_line(page: server.Page, tmp_path: Path) -> None:
    token = page.address.partition("token=")[2]
    door = page.door()
    assert token not in door.as_uri()
    assert token in door.read_text()
    assert door.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("rtsp://lab:secret@10.0.0.2/feed", "rtsp://lab:***@10.0.0.2/feed"),
        ("rtsp://lab:s/e@cret@10.0.0.2:554/feed", "rtsp://lab:***@10.0.0.2:554/feed"),
        ("http://10.0.0.2/video.cgi?user=lab&pwd=secret&rate=25", "http://10.0.0.2/video.cgi?user=***&pwd=***&rate=25"),
        ("http://10.0.0.2/feed?loginpas=secret", "http://10.0.0.2/feed?loginpas=***"),
        ("rtsp://10.0.0.2:554/feed?channel=1", "rtsp://10.0.0.2:554/feed?channel=1"),
    ],
)
def test_a_cameras_password_is_never_shown(address: str, shown: str) -> None:
    assert without_password(address) == shown
    assert "secret" not in without_password(address)
