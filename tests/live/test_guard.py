"""Which names, origins and tokens are let in, whatever address is bound."""

import asyncio
from typing import Any

import pytest

from fingervision.live.guard import Guard

TOKEN = "secret"


def status(
    bound: str, port: int, host: str, origin: str | None = None, token: str = TOKEN, kind: str = "http", path: str = "/"
) -> int:
    """Status with which a request is answered; 0 where a socket is closed before it opens."""
    sent: list[Any] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> Any:
        return {"type": f"{kind}.disconnect"}

    headers = [(b"host", host.encode())] + ([] if origin is None else [(b"origin", origin.encode())])
    scope = {"type": kind, "method": "GET", "path": path, "query_string": f"token={token}".encode(), "headers": headers}
    asyncio.run(Guard(app, bound, port, TOKEN)(scope, receive, send))
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
