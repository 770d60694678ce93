"""A second real browser for the page: Debian's Firefox, driven through its own protocol (W3C WebDriver BiDi)."""

import base64
import json
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
needs_firefox = pytest.mark.skipif(
    FIREFOX is None, reason="Firefox is not installed: the page is tested in it as well."
)
PATIENCE_S = 120.0
# Firefox asks for updates, extensions and studies at every start, which tests have no business with.
PREFERENCES = {
    "app.normandy.enabled": "false",
    "app.update.enabled": "false",
    "browser.safebrowsing.update.enabled": "false",
    "datareporting.policy.dataSubmissionEnabled": "false",
    "network.captive-portal-service.enabled": "false",
    "network.connectivity-service.enabled": "false",
    "remote.active-protocols": "1",
    "services.settings.server": '"data:,"',
}
DARK, LIGHT = "0", "1"


class Firefox:
    """One tab; what it logged and asked the network for is kept.

    Parameters
    ----------
    socket : websockets connection
        To the browser's session.
    """

    def __init__(self, socket: ClientConnection) -> None:
        self._socket, self._numbers = socket, count(1)
        self.logged: list[str] = []
        self.asked_for: list[str] = []
        self._ask("session.new", capabilities={})
        self._tab = self._ask("browsingContext.getTree")["contexts"][0]["context"]
        self._ask("session.subscribe", events=["log.entryAdded", "network.beforeRequestSent"])

    def _ask(self, method: str, **parameters: Any) -> Any:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(PATIENCE_S))
            if answer.get("id") == number:
                assert answer["type"] == "success", answer
                return answer["result"]
            if answer.get("method") == "log.entryAdded":
                self.logged.append(f"{answer['params']['level']}: {answer['params']['text']}")
            elif answer.get("method") == "network.beforeRequestSent":
                self.asked_for.append(answer["params"]["request"]["url"])

    def open(self, address: str, width: int, height: int) -> None:
        self._ask("browsingContext.setViewport", context=self._tab, viewport={"width": width, "height": height})
        self._ask("browsingContext.navigate", context=self._tab, url=address, wait="complete")

    def value(self, words: str) -> Any:
        """What an expression gives: a number, a text, a truth, or JSON of anything else."""
        told = self._ask("script.evaluate", expression=words, target={"context": self._tab}, awaitPromise=True)
        assert told["type"] == "success", told
        return told["result"].get("value")

    def until(self, words: str) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not self.value(words):
            assert time.monotonic() < end_s, f"not true in time: {words}"
            time.sleep(0.05)

    def press(self, key: str) -> None:
        keys = [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]
        self._ask("input.performActions", context=self._tab, actions=[{"type": "key", "id": "keys", "actions": keys}])

    def picture(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self._ask("browsingContext.captureScreenshot", context=self._tab)["data"]))


@contextmanager
def firefox(profile: Path, scheme: str) -> Iterator[Firefox]:
    """A browser of its own that prefers this scheme of colours, without anybody's settings."""
    profile.mkdir()
    wanted = {**PREFERENCES, "layout.css.prefers-color-scheme.content-override": scheme}
    lines = [f'user_pref("{name}", {value});\n' for name, value in wanted.items()]
    (profile / "user.js").write_text("".join(lines), encoding="utf-8")
    words = [str(FIREFOX), "--headless", "--no-remote", "--remote-debugging-port", "0", "--profile", str(profile)]
    log = profile / "stderr.txt"
    with log.open("w") as stderr:
        process = subprocess.Popen([*words, "about:blank"], stderr=stderr, stdout=subprocess.DEVNULL)
    try:
        end_s = time.monotonic() + PATIENCE_S
        while not (found := re.search(r"BiDi listening on (ws://\S+)", log.read_text())):
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < end_s, log.read_text()
            time.sleep(0.1)
        with connect(f"{found[1]}/session", max_size=None) as socket:
            yield Firefox(socket)
    finally:
        process.terminate()
        process.wait(PATIENCE_S)
