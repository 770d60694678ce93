"""Limits for idle network connections: their number from one address, and their duration."""

import asyncio
from collections import defaultdict
from typing import Any, ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

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
