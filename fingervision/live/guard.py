"""Access control of the web server: it admits only browser pages that have a token (and any password)."""

import asyncio
import base64
import binascii
import hmac
import ipaddress
import socket
from collections import defaultdict
from collections.abc import Mapping
from typing import Any, ClassVar
from urllib.parse import parse_qs

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose
from uvicorn.protocols.http.h11_impl import H11Protocol

# Limits for idle network connections: their number from one address, and their duration.


# Limits for connections without a request, from one address: their number, and their duration. A browser sends its
# first request as soon as it is connected.
HALF_OPEN_AT_ONCE, ASKS_WITHIN_S = 16, 5.0


class PatientProtocol(H11Protocol):
    """HTTP protocol of Uvicorn that closes connections on which no request arrives in time.

    Idle connections would otherwise use up the number of connections available to other clients. If one address has too
    many open connections, the oldest of them is closed in favour of the newest.
    """

    half_open: ClassVar[defaultdict[str, dict["PatientProtocol", asyncio.TimerHandle]]] = defaultdict(dict)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the time limit for the first request of a new connection."""
        super().connection_made(transport)
        peer = transport.get_extra_info("peername")
        self._address = str(peer[0]) if peer else ""
        waiting = self.half_open[self._address]
        waiting[self] = self.loop.call_later(ASKS_WITHIN_S, transport.close)
        if len(waiting) > HALF_OPEN_AT_ONCE:
            oldest = next(iter(waiting))
            oldest.transport.close()
            oldest.heard()

    def handle_events(self) -> None:
        """End the time limit of a connection once a request has arrived."""
        super().handle_events()
        if self.cycle is not None:
            self.heard()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Pass the connection to the WebSocket protocol, which has its own time limit."""
        self.heard()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Remove a closed connection from the list of connections."""
        self.heard()
        super().connection_lost(exc)

    def heard(self) -> None:
        """End the time limit of a connection, because a request has arrived."""
        waiting = self.half_open[self._address]
        timer = waiting.pop(self, None)
        if timer is not None:
            timer.cancel()
        if not waiting:
            self.half_open.pop(self._address, None)


LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
EVERYWHERE = frozenset({"0.0.0.0", "::"})
# The browser loads scripts and styles from this server only, connects to this server only, and refuses frames.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
# The files under this path (script, style, licence) contain no data of the user, so that they need no token.
PUBLIC_PATH = "/page/"
POLICY_VIOLATION, UNAUTHORISED = 1008, 401
WRITER, VIEWER = "writer", "viewer"
GUESS_COSTS_S = 1.0


class Guard:
    """Lets allowed requests through, and adds headers that isolate the browser page from other sites.

    The header Host must be a name of this server (so that another site cannot redirect its own name to this server),
    the header Origin must be the same (so that no other page can open a socket), and the address must contain a token.

    Parameters
    ----------
    app : ASGI application
        Application to which allowed requests are passed.
    host : str
        Network address to which the server is bound.
    port : int
        Port of the server.
    tokens : mapping of str to str
        Tokens, one of which every address must contain, with the role that each grants (`WRITER` or `VIEWER`).
    password : str
        Password required for every request; empty for no password.
    scheme : str
        Scheme of the page's address: http or https.
    """

    def __init__(
        self, app: ASGIApp, host: str, port: int, tokens: Mapping[str, str], password: str = "", scheme: str = "http"
    ) -> None:
        self._app, self._host, self._port, self._tokens = app, host, port, dict(tokens)
        self._password, self._scheme = password, scheme
        self._guess = asyncio.Lock()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        refused = self._refusal(scope)
        if refused is not None and refused[0] == UNAUTHORISED:
            # Wrong passwords are answered one per second, for all clients together; a right password is answered at
            # once.
            async with self._guess:
                await asyncio.sleep(GUESS_COSTS_S)
        if refused is None:
            await self._app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await WebSocketClose(POLICY_VIOLATION, refused[1])(scope, receive, send)
        else:
            asks = {"WWW-Authenticate": 'Basic realm="fingervision"'} if refused[0] == UNAUTHORISED else None
            await PlainTextResponse(refused[1], refused[0], asks)(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        headers = Headers(scope=scope)
        if not self._is_ours(headers.get("host", "")):
            return (
                400,
                "The header Host must be the address of this live view: open the address that the terminal shows.",
            )
        origin = headers.get("origin")
        if origin is None and scope["type"] == "websocket":
            return 403, "The header Origin must be the address of this live view, but is missing."
        if origin is not None and origin != f"{self._scheme}://{headers.get('host', '')}":
            return (
                403,
                "The header Origin must be the address of this live view: open the address that the terminal shows.",
            )
        if self._password and not is_password(headers.get("authorization", ""), self._password):
            return UNAUTHORISED, "This live view needs its password: enter the password with any user name."
        if scope["type"] == "http" and scope["path"].startswith(PUBLIC_PATH):
            return None
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
        # All tokens are compared, so that the response time does not depend on which token matches.
        roles = [role for token, role in self._tokens.items() if hmac.compare_digest(given.encode(), token.encode())]
        if not roles:
            return 403, "The address must contain the token: open the address that the terminal shows."
        scope["role"] = roles[0]
        return None

    def _is_ours(self, stated: str) -> bool:
        # Browsers leave out the default ports: 80 of http, and 443 of https.
        usual = 443 if self._scheme == "https" else 80
        full = f"{stated}:{usual}" if self._port == usual and not stated.endswith(f":{usual}") else stated
        name, _, port = full.rpartition(":")
        if not name or port != str(self._port):
            return False
        name = name.strip("[]").lower()
        if name in LOOPBACK_NAMES | {self._host.lower()}:
            return True
        return self._host in EVERYWHERE and (_is_address(name) or name == socket.gethostname().lower())


def is_password(header: str, password: str) -> bool:
    """Whether an Authorization header (HTTP Basic, any user) contains the password; compared in constant time."""
    kind, _, coded = header.partition(" ")
    try:
        given = base64.b64decode(coded, validate=True).partition(b":")[2] if kind.lower() == "basic" else b""
    except (binascii.Error, ValueError):
        return False
    return hmac.compare_digest(given, password.encode())


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            added = [(name.lower().encode(), words.encode()) for name, words in HEADERS.items()]
            message = {**message, "headers": [*message.get("headers", []), *added]}
        await send(message)

    return sending
