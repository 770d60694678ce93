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
ENOUGH = 40
"""Pictures after which a source that goes on is stopped."""
FRAME = "Number(document.querySelector('#gap_mm').dataset.frame || 0)"
LAST = "Number(document.querySelector('#scrub').max)"
SHOWN = "Number(document.querySelector('#picture').dataset.shown || 0)"


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_runs_to_its_end_without_an_alarm(
    example: str, live: Callable[..., Any], tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    copy_example("measure", tmp_path / "case")
    shutil.copytree(tmp_path / "case", tmp_path, dirs_exist_ok=True)
    (tmp_path / "comsol.csv").write_text("input_mm,gap_mm\n-1,-3.7\n3,27.2\n")
    command, *words = [here(word, live, tmp_path, request) for word in words_of(example)]
    if "--list" in words:
        assert live(*words).process.wait(60.0) == 0
    elif "--no-page" in words:
        view = live(*words)
        # Two rows of JSON; without --json a line now and then, because this is no terminal.
        view.until(lambda view: len(view.lines()) > 1 if "--json" in words else "gap " in view.text())
        ended(view)
        assert view.runs()  # all of the tests' views have --out
    else:
        quiet = ["--no-browser"] if command == "gauge" and "--no-browser" not in words else []
        view = live(*words, *quiet, "--port", "0", name=command)
        page = request.getfixturevalue("opened")(view.address)
        looked_through(page, words)
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


def looked_through(page: Any, words: list[str]) -> None:
    """Play a recording to its end, or look on until enough frames have come."""
    # The network camera's fingers point up.
    if "down" not in words:
        shown(page, "Number(document.querySelector('#gap_mm').textContent) > 0")
    if "opening.mp4" in words or any("runs/" in word for word in words):
        shown(page, LAST + " > 0 && document.querySelector('#play').textContent === 'Play'")
        page.locator("body").press("p")
        shown(page, f"{FRAME} === {LAST}")
    else:
        begun = page.evaluate(SHOWN)
        shown(page, f"{SHOWN} > {begun + ENOUGH}")
    if "--model" in words:
        shown(page, r"/ \d{3} samples/.test(document.querySelector('#model_words').textContent)")


def ended(view: Any) -> None:
    """Interrupt a view, which then ends in order."""
    assert view.stop() == 0, view.text()
    assert not re.search("Traceback|failed", view.text()), view.text()
