"""Real browsers for tests of the page: Debian's Chromium and Firefox, controlled by Playwright; what tests do there."""

import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

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
# Firefox fetches and reports nothing by itself, and its panel of downloads takes no focus from the page.
SETTINGS = {
    "app.update.enabled": False,
    "browser.download.alwaysOpenPanel": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.enabled": False,
}
# What is not the page's: the browser's own words of a server that is not running, because a test may end its server
# while the page still asks for the next picture, and the empty style that Playwright adds for a screenshot.
NOT_THE_PAGES = re.compile(
    r"WebSocket connection to|net::ERR_CONNECTION_REFUSED|connection to the server at ws:|to ws:\S+ was interrupted|"
    r"sha256-YjaKGiklmzC6wjXA513HAMmzus8VE61XCOT\+SmwNZWA="
)
PATIENCE_MS = 120_000


# What pages of this process save.
DOWNLOADS = Path(tempfile.gettempdir()) / f"fingervision_downloads_{os.getpid()}"


class Chromium:
    """Debian's Chromium, whose pages are each told what their user prefers."""

    PROGRAM = shutil.which("chromium")

    def __init__(self, playwright: Any) -> None:
        self._started = playwright.chromium.launch(
            executable_path=self.PROGRAM, args=QUIET, timeout=PATIENCE_MS, downloads_path=DOWNLOADS
        )

    def new_context(self, **options: Any) -> Any:
        """An empty profile."""
        return self._started.new_context(**options)

    def close(self) -> None:
        """End what was started."""
        self._started.close()


class Firefox:
    """Debian's Firefox over WebDriver BiDi, told its preferences when it starts: one program for each."""

    PROGRAM = shutil.which("firefox-esr") or shutil.which("firefox")

    def __init__(self, playwright: Any) -> None:
        self._launch = playwright.firefox.launch
        self._started: dict[tuple[bool, bool], Any] = {}

    def new_context(self, *, color_scheme: str = "light", reduced_motion: str = "no-preference", **options: Any) -> Any:
        """An empty profile."""
        is_dark, is_still = preferred = (color_scheme == "dark", reduced_motion == "reduce")
        if preferred not in self._started:
            settings = {
                "layout.css.prefers-color-scheme.content-override": int(not is_dark),
                "ui.prefersReducedMotion": int(is_still),
            }
            self._started[preferred] = self._launch(
                channel="moz-firefox",
                executable_path=self.PROGRAM,
                firefox_user_prefs=SETTINGS | settings,
                timeout=PATIENCE_MS,
                downloads_path=DOWNLOADS,
            )
        return self._started[preferred].new_context(**options)

    def close(self) -> None:
        """End what was started."""
        for each in self._started.values():
            each.close()


def _or_skipped(kind: Any, *marks: Any) -> Any:
    name = kind.__name__
    missing = pytest.mark.skipif(kind.PROGRAM is None, reason=f"{name} is not installed: the page is tested in it.")
    return pytest.param(kind, marks=[missing, *marks], id=name.lower())


# What a fast test shows in Chromium, the slow tests show in Firefox as well.
@pytest.fixture(scope="module", params=[_or_skipped(Chromium), _or_skipped(Firefox, pytest.mark.slow)])
def browser(request: pytest.FixtureRequest) -> Iterator[Any]:
    """A browser in which pages are opened: the test is repeated in each that is installed."""
    playwright_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed.")
    with playwright_api.sync_playwright() as playwright:
        found = request.param(playwright)
        yield found
        found.close()
    shutil.rmtree(DOWNLOADS, ignore_errors=True)


def downloaded(page: Any, act: Callable[[], Any]) -> Path:
    """The file that is saved by an action; Firefox says nothing of one that the page itself has made."""
    before = set(DOWNLOADS.glob("*"))
    act()
    end_s = time.monotonic() + PATIENCE_MS / 1e3
    while not (found := [path for path in set(DOWNLOADS.glob("*")) - before if path.stat().st_size]) or any(
        path.suffix in (".part", ".crdownload") for path in found
    ):
        assert time.monotonic() < end_s, "nothing was saved in time"
        page.wait_for_timeout(50)
    return found[0]


@pytest.fixture
def opened(browser: Any, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Callable[..., Any]]:
    """Open pages, record their requests and errors, keep a screenshot, and refuse requests to other machines."""
    contexts, requests, errors = [], [], []

    def heard(words: str) -> None:
        if not NOT_THE_PAGES.search(words):
            errors.append(words)

    def open_page(address: str, **context: Any) -> Any:
        contexts.append(browser.new_context(**context))
        page = contexts[-1].new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("request", lambda each: requests.append(each.url))
        page.on("websocket", lambda each: requests.append(each.url))
        page.on("pageerror", lambda each: heard(str(each)))
        page.on("console", lambda each: heard(f"{each.type}: {each.text}"))
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


def keep(page: Any, name: str) -> None:
    """Keep a screenshot where the environment says, for whoever wants to look."""
    if SCREENSHOTS:
        kind = page.context.browser.browser_type.name
        page.screenshot(path=Path(SCREENSHOTS) / f"{name}_{kind}.png", full_page=True)


def says(page: Any, words: str) -> None:
    page.locator("#log li", has_text=words).first.wait_for()


def typed(page: Any, field: str, words: str) -> None:
    """Type into a field as a person does: Firefox does not tell the page of a change that a program made."""
    page.press(field, "ControlOrMeta+a")
    page.keyboard.press("Delete")
    page.keyboard.type(words)
    page.keyboard.press("Enter")


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
