"""A real browser for tests of the page: Debian's Chromium, controlled by Playwright, with the actions of the tests."""

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is tested in it.")
# Screenshots stay where the environment says, for whoever looks at a failure in CI.
SCREENSHOTS = os.environ.get("FINGERVISION_SCREENSHOTS")
QUIET = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# What the browser itself says of a server that is not running: a test may end its server while the page still asks for
# the next picture.
UNREACHABLE = ("WebSocket connection to", "net::ERR_CONNECTION_REFUSED")
PATIENCE_MS = 120_000


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed.")
    with playwright_api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET, timeout=PATIENCE_MS)
        yield found
        found.close()


@pytest.fixture
def opened(browser: Any, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Callable[..., Any]]:
    """Open pages, record their requests and errors, keep a screenshot, and refuse requests to other machines."""
    contexts, requests, errors = [], [], []

    def heard(message: Any) -> None:
        if not any(words in message.text for words in UNREACHABLE):
            errors.append(f"{message.type}: {message.text}")

    def open_page(address: str, **context: Any) -> Any:
        contexts.append(browser.new_context(**context))
        page = contexts[-1].new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("request", lambda each: requests.append(each.url))
        page.on("websocket", lambda each: requests.append(each.url))
        page.on("pageerror", lambda each: errors.append(str(each)))
        page.on("console", heard)
        page.goto(address)
        return page

    yield open_page
    folder = Path(SCREENSHOTS) if SCREENSHOTS else tmp_path
    folder.mkdir(parents=True, exist_ok=True)
    for number, context in enumerate(contexts):
        for page in context.pages:
            page.screenshot(path=folder / f"{request.node.name}_{number}.png", full_page=True)
        context.close()
    assert not errors, errors
    assert requests
    assert all(re.match(r"(http|ws|blob:http)://127\.0\.0\.1:\d+/", url) for url in requests), requests


def shown(page: Any, words: str) -> None:
    """Wait until an expression is true, evaluated from outside, because the page's security policy forbids running
    text.
    """
    end_s = time.monotonic() + PATIENCE_MS / 1e3
    while not page.evaluate(words):
        assert time.monotonic() < end_s, f"not true in time: {words}"
        page.wait_for_timeout(50)


def says(page: Any, words: str) -> None:
    page.locator("#log li", has_text=words).first.wait_for()


def drag(page: Any, box: tuple[int, int, int, int]) -> None:
    """Drag the mouse over a part of the picture, in the picture's pixels."""
    page.locator("#picture").scroll_into_view_if_needed()
    frame = page.locator("#picture").bounding_box()
    width, height = page.evaluate(
        "[document.querySelector('#picture').width, document.querySelector('#picture').height]"
    )
    x, y = frame["width"] / width, frame["height"] / height
    page.mouse.move(frame["x"] + box[0] * x, frame["y"] + box[1] * y)
    page.mouse.down()
    page.mouse.move(frame["x"] + (box[0] + box[2] / 2) * x, frame["y"] + (box[1] + box[3] / 2) * y)
    page.mouse.move(frame["x"] + (box[0] + box[2]) * x, frame["y"] + (box[1] + box[3]) * y)
    page.mouse.up()
