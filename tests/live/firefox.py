"""Debian's Firefox for tests of the page, controlled by the W3C standard WebDriver BiDi over its own socket."""

import base64
import itertools
import json
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from tests.waiting import until

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
needs_firefox = pytest.mark.skipif(FIREFOX is None, reason="Firefox is not installed: the page is tested in it.")
START_S, ANSWER_S, PATIENCE_S = 120.0, 120.0, 120.0
SPEAKS = re.compile(r"WebDriver BiDi listening on (ws://\S+)")
# What the browser itself says of a server that is not running any more.
UNREACHABLE = re.compile(r"establish a connection to the server at ws:|to ws:\S+ was interrupted")
# Nothing is fetched or reported by the browser itself.
SETTINGS = {
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.enabled": False,
}
ENTER = "\ue007"


class Firefox:
    """One window; script errors in its console are kept in `errors`.

    Parameters
    ----------
    profile : Path
        An empty folder for its settings.
    dark : bool
        Whether the user prefers dark pages.
    """

    def __init__(self, profile: Path, *, dark: bool = False) -> None:
        override = "layout.css.prefers-color-scheme.content-override"
        settings = SETTINGS | {"ui.systemUsesDarkTheme": int(dark), override: int(not dark)}
        lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in settings.items())
        (profile / "user.js").write_text("\n".join(lines), encoding="utf-8")
        log = profile / "log"
        command = [str(FIREFOX), "--headless", "--no-remote", "--profile", str(profile), "--remote-debugging-port", "0"]
        with log.open("w") as out:
            self._process = subprocess.Popen(command, stdout=out, stderr=out, stdin=subprocess.DEVNULL)
        end_s = time.monotonic() + START_S
        while not (found := SPEAKS.search(log.read_text(errors="replace"))):
            assert self._process.poll() is None, log.read_text(errors="replace")
            assert time.monotonic() < end_s, log.read_text(errors="replace")
            time.sleep(0.1)
        self.errors: list[str] = []
        self._numbers = itertools.count(1)
        self._stack = ExitStack()
        self._stack.callback(self._end)
        self._socket = self._stack.enter_context(connect(f"{found[1]}/session", max_size=None, open_timeout=START_S))
        self._ask("session.new", capabilities={})
        self._ask("session.subscribe", events=["log.entryAdded"])
        self._window = self._ask("browsingContext.getTree")["contexts"][0]["context"]

    def close(self) -> None:
        """End the browser that was started here."""
        with suppress(Exception):
            self._ask("browser.close")
        self._stack.close()

    def _end(self) -> None:
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def open(self, address: str, size_px: tuple[int, int] = (1280, 720)) -> None:
        """Show an address."""
        viewport = {"width": size_px[0], "height": size_px[1]}
        self._ask("browsingContext.setViewport", context=self._window, viewport=viewport)
        self._ask("browsingContext.navigate", context=self._window, url=address, wait="complete")

    def evaluate(self, words: str) -> Any:
        """Value of an expression, converted to JSON."""
        found = self._ask(
            "script.evaluate",
            expression=f"JSON.stringify({words})",
            target={"context": self._window},
            awaitPromise=True,
        )
        assert found["type"] == "success", found
        value = found["result"].get("value")
        return None if value is None else json.loads(value)

    def shown(self, words: str) -> None:
        """Wait until an expression is true."""
        until(lambda: self.evaluate(f"Boolean({words})"), lambda: f"not true in time: {words}", PATIENCE_S)

    def press(self, keys: str) -> None:
        """Type into the focused element."""
        actions = [{"type": kind, "value": key} for key in keys for kind in ("keyDown", "keyUp")]
        self._act({"type": "key", "id": "keys", "actions": actions})

    def click(self, what: str) -> None:
        """Click the centre of an element with the mouse."""
        self.evaluate(f"document.querySelector({what!r}).scrollIntoView({{block: 'center'}}) || 0")
        box = self.box(what)
        self._pointer([(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)])

    def fill(self, what: str, words: str) -> None:
        """Type into a field and end with Enter."""
        self.evaluate(f"(document.querySelector({what!r}).focus(), document.querySelector({what!r}).value = '', 0)")
        self.press(words + ENTER)

    def drag(self, box: tuple[int, int, int, int]) -> None:
        """Drag the mouse over a part of the picture, in the picture's pixels."""
        self.evaluate("document.querySelector('#picture').scrollIntoView({block: 'center'}) || 0")
        frame = self.box("#picture")
        width, height = self.evaluate(
            "[document.querySelector('#picture').width, document.querySelector('#picture').height]"
        )
        x, y = frame["width"] / width, frame["height"] / height
        self._pointer(
            [
                (frame["x"] + (box[0] + share * box[2]) * x, frame["y"] + (box[1] + share * box[3]) * y)
                for share in (0.0, 0.5, 1.0)
            ]
        )

    def box(self, what: str) -> dict[str, float]:
        """Rectangle of an element in the window, in CSS pixels."""
        return dict(self.evaluate(f"document.querySelector({what!r}).getBoundingClientRect()"))

    def screenshot(self, path: Path) -> None:
        """Save a screenshot of the window."""
        data = self._ask("browsingContext.captureScreenshot", context=self._window)["data"]
        path.write_bytes(base64.b64decode(data))

    def _pointer(self, places: list[tuple[float, float]]) -> None:
        moves = [{"type": "pointerMove", "x": round(x), "y": round(y)} for x, y in places]
        down, up = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}
        self._act({"type": "pointer", "id": "mouse", "actions": [moves[0], down, *moves[1:], up]})

    def _act(self, source: dict[str, Any]) -> None:
        self._ask("input.performActions", context=self._window, actions=[source])

    def _ask(self, method: str, **params: Any) -> dict[str, Any]:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            found = json.loads(self._socket.recv(timeout=ANSWER_S))
            if found.get("type") == "event":
                self._heard(found)
            elif found.get("id") == number:
                assert found["type"] == "success", found
                return dict(found["result"])

    def _heard(self, event: dict[str, Any]) -> None:
        entry = event["params"]
        is_bad = event["method"] == "log.entryAdded" and entry["level"] in ("warn", "error")
        if is_bad and not UNREACHABLE.search(str(entry["text"])):
            self.errors.append(str(entry["text"]))


@pytest.fixture(params=["light", "dark"])
def firefox(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Firefox]:
    """A separate browser for each test and colour scheme, whose console must remain empty."""
    (profile := tmp_path / "profile").mkdir()
    found = Firefox(profile, dark=request.param == "dark")
    try:
        yield found
        assert not found.errors, found.errors
    finally:
        found.close()
