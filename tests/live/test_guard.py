"""Host names, origins and tokens that are admitted, for any bound address."""

import asyncio
import base64
import time
from typing import Any

import pytest

from fingervision.live import guard
from fingervision.live.guard import WRITER, Guard

TOKEN = "secret"


def status(
    bound: str,
    port: int,
    host: str,
    origin: str | None = None,
    token: str = TOKEN,
    kind: str = "http",
    path: str = "/",
    password: str = "",
    scheme: str = "http",
    header: bytes | None = None,
) -> int:
    """Status code of the answer to a request; 0 if a socket is closed before it opens."""
    sent: list[Any] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> Any:
        return {"type": f"{kind}.disconnect"}

    headers = [(b"host", host.encode())] + ([] if origin is None else [(b"origin", origin.encode())])
    headers += [] if header is None else [(b"authorization", header)]
    scope = {"type": kind, "method": "GET", "path": path, "query_string": f"token={token}".encode(), "headers": headers}
    asyncio.run(Guard(app, bound, port, {TOKEN: WRITER}, password, scheme)(scope, receive, send))
    return int(sent[0].get("status", 0))


@pytest.mark.parametrize(
    ("bound", "port", "host", "expected"),
    [
        ("127.0.0.1", 8025, "127.0.0.1:8025", 200),
        ("127.0.0.1", 8025, "localhost:8025", 200),
        ("127.0.0.1", 8025, "localhost:8026", 400),
        ("127.0.0.1", 8025, "evil.example:8025", 400),
        ("127.0.0.1", 8025, "", 400),
        ("127.0.0.1", 80, "localhost", 200),
        ("::1", 8025, "[::1]:8025", 200),
        ("0.0.0.0", 8025, "192.0.2.7:8025", 200),
        ("0.0.0.0", 8025, "evil.example:8025", 400),
    ],
)
def test_only_names_of_this_server_are_served(bound: str, port: int, host: str, expected: int) -> None:
    assert status(bound, port, host) == expected


def test_a_foreign_or_missing_origin_and_a_wrong_token_are_refused() -> None:
    here = ("127.0.0.1", 8025, "127.0.0.1:8025")
    assert status(*here, origin="http://127.0.0.1:8025") == 200
    assert status(*here, origin="http://evil.example") == 403
    assert status(*here, origin="null") == 403
    assert status(*here, token="") == 403
    assert status(*here, token="secret2") == 403
    assert status(*here, token="", path="/page/live.js") == 200
    assert status(*here, kind="websocket") == 0
    assert status(*here, kind="websocket", origin="http://127.0.0.1:8025") == 200


def basic(words: str) -> bytes:
    return b"Basic " + base64.b64encode(f"anybody:{words}".encode())


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        (None, 401),
        (basic("twelve letters"), 200),
        (basic("twelve letter"), 401),
        (basic(""), 401),
        (b"Basic ===", 401),
        (b"Bearer twelve letters", 401),
        (b"Basic " + base64.b64encode(b"twelve letters"), 401),
    ],
)
def test_where_a_password_is_stated_nothing_is_given_without_it(
    header: bytes | None, expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guard, "GUESS_COSTS_S", 0.0)
    for path, token in (("/", TOKEN), ("/page/live.js", "")):
        found = status(
            "0.0.0.0", 8025, "192.0.2.7:8025", token=token, path=path, password="twelve letters", header=header
        )
        assert found == expected
    assert (
        status(
            "0.0.0.0", 8025, "192.0.2.7:8025", token="wrong", password="twelve letters", header=basic("twelve letters")
        )
        == 403
    )


def test_guesses_of_the_password_wait_for_one_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "GUESS_COSTS_S", 0.1)
    sent: list[int] = []

    async def send(message: Any) -> None:
        sent.append(message.get("status", 0))

    async def receive() -> Any:
        return {"type": "http.disconnect"}

    async def guesses(count: int) -> float:
        guarded = Guard(None, "127.0.0.1", 8025, {TOKEN: WRITER}, "twelve letters")  # type: ignore[arg-type]
        headers = [(b"host", b"127.0.0.1:8025")]
        scope = {"type": "http", "method": "GET", "path": "/", "query_string": b"", "headers": headers}
        began_s = time.monotonic()
        await asyncio.gather(*(guarded(dict(scope), receive, send) for _ in range(count)))
        return time.monotonic() - began_s

    assert asyncio.run(guesses(5)) >= 0.5
    assert sent.count(401) == 5


def test_over_tls_the_pages_origin_is_that_of_tls() -> None:
    here = ("127.0.0.1", 8025, "127.0.0.1:8025")
    assert status(*here, origin="https://127.0.0.1:8025", scheme="https") == 200
    assert status(*here, origin="http://127.0.0.1:8025", scheme="https") == 403
    assert status("127.0.0.1", 443, "127.0.0.1", scheme="https") == 200
