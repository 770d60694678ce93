"""Every example of `live --help` and `gauge --help` runs to its end, with a browser page on it where it has one.

Network cameras play what the examples' addresses and camera numbers stand for. The example with the settings of a
camera on /dev is left to `test_camera_controls`: this machine has none.
"""

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fingervision.interface.examples import copy_example
from tests.cli.test_help_examples import ALL, words_of
from tests.live.browser import browser, opened, shown
from tests.live.conftest import NetworkCamera
from tests.live.test_rtsp_camera import RtspCamera, rtsp_camera

__all__ = ["browser", "opened", "rtsp_camera"]

EXAMPLES = [each for name in ("live", "gauge") for each in ALL[name] if "/dev/" not in each]
# `gauge --no-page` serves a page and only opens no browser.
IN_THE_TERMINAL = [each for each in EXAMPLES if " live " in each and {"--list", "--no-page"} & set(each.split())]
ENOUGH = 40
"""Pictures after which a source that goes on is stopped."""
FRAME = "Number(document.querySelector('#gap_mm').dataset.frame || 0)"
LAST = "Number(document.querySelector('#scrub').max)"
SHOWN = "Number(document.querySelector('#picture').dataset.shown || 0)"


@pytest.fixture
def begun(live: Callable[..., Any], tmp_path: Path, request: pytest.FixtureRequest) -> Callable[[str], tuple[Any, ...]]:
    """Start an example in the folder that it is written for: the view, and the example's words."""

    def begin(example: str) -> tuple[Any, ...]:
        copy_example("measure", tmp_path / "case")
        shutil.copytree(tmp_path / "case", tmp_path, dirs_exist_ok=True)
        (tmp_path / "comsol.csv").write_text("input_mm,gap_mm\n-1,-3.7\n3,27.2\n")
        for name in ("faulty.mp4", "healthy.mp4"):
            shutil.copy(tmp_path / "opening.mp4", tmp_path / name)
        command, *words = [here(word, live, tmp_path, request) for word in words_of(example)]
        quiet = ["--no-page"] if command == "gauge" and "--no-page" not in words else []
        where = [] if example in IN_THE_TERMINAL else ["--port", "0"]
        return live(*words, *quiet, *where, name=command), words

    return begin


@pytest.mark.slow
@pytest.mark.parametrize("example", IN_THE_TERMINAL)
def test_an_example_without_a_page_runs_to_its_end(example: str, begun: Callable[[str], tuple[Any, ...]]) -> None:
    view, words = begun(example)
    if "--list" in words:
        assert view.process.wait(60.0) == 0
        return
    # Two rows of JSON; without --json a line now and then, because this is no terminal.
    view.until(lambda view: len(view.lines()) > 1 if "--json" in words else "gap " in view.text())
    ended(view)
    assert view.runs()  # all of the tests' views have --out


@pytest.mark.slow
@pytest.mark.parametrize("example", [each for each in EXAMPLES if each not in IN_THE_TERMINAL])
def test_an_example_runs_to_its_end_without_an_alarm(
    example: str, begun: Callable[[str], tuple[Any, ...]], opened: Callable[..., Any]
) -> None:
    view, words = begun(example)
    page = opened(view.address)
    looked_through(page, words, has_fingers=" gauge " not in example)
    assert page.locator("#alarm").is_hidden(), page.locator("#alarm").text_content()
    page.close()
    ended(view)


def here(word: str, live: Callable[..., Any], folder: Path, request: pytest.FixtureRequest) -> str:
    """What a word of an example stands for on this machine."""
    if word == "0" or word.startswith("http://"):
        camera: NetworkCamera = request.getfixturevalue("camera")
        return camera.address
    if word.startswith("rtsp://"):
        rtsp: RtspCamera = request.getfixturevalue("rtsp_camera")
        rtsp.wait()
        return rtsp.address
    if word.startswith("runs/"):
        view = live("simulated", "--no-page", out=folder / "runs")
        view.until(lambda view: view.runs() and len((view.runs()[0] / "gaps.csv").read_text().splitlines()) > ENOUGH)
        ended(view)
        return str(view.runs()[0])
    return word


def looked_through(page: Any, words: list[str], *, has_fingers: bool) -> None:
    """Play a recording to its end, or look on until enough frames have come."""
    # The network camera's fingers point up.
    if has_fingers and "down" not in words:
        shown(page, "Number(document.querySelector('#gap_mm').textContent) > 0")
    if any(word.endswith(".mp4") or "runs/" in word for word in words):
        shown(page, LAST + " > 0 && document.querySelector('#play').textContent === 'Play'")
        page.locator("body").press("p")
        shown(page, f"{FRAME} === {LAST}")
    else:
        begun = page.evaluate(SHOWN)
        shown(page, f"{SHOWN} > {begun + ENOUGH}")
    if "--model" in words:
        shown(page, r"/\b\d{3} samples/.test(document.querySelector('#model_words').textContent)")


def ended(view: Any) -> None:
    """Interrupt a view, which then ends in order."""
    assert view.stop() == 0, view.text()
    assert not re.search("Traceback|failed", view.text()), view.text()
