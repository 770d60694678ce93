"""Waiting for what another thread or process does."""

import socket
import time
from collections.abc import Callable
from typing import Any


def until(found: Callable[[], Any], words: Callable[[], str] = str, within_s: float = 120.0) -> Any:
    """Ask again and again; return the first answer that is true, or fail with these words."""
    end_s = time.monotonic() + within_s
    while not (value := found()):
        assert time.monotonic() < end_s, words()
        time.sleep(0.02)
    return value


def free_port() -> int:
    """Number of a port at which nothing listened a moment ago."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return int(listening.getsockname()[1])
