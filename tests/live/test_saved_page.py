"""The page of a recording as a file: its values beside the picture of their own frame, and nothing from a network."""

import csv
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.error import HTTPError

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.live.choices import Choices
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import recorded
from fingervision.rendering import Camera, render, two_fingers
from tests.live.browser import browser, downloaded, shown
from tests.live.conftest import serving
from tests.waiting import until

__all__ = ["browser"]
FRAMES, RATE_HZ, PX_PER_MM, WIDEST = 30, 25.0, 34.0, 14
PICTURES = (0, WIDEST, FRAMES - 1)
# Markup in the name of a recording is text in the page.
NAME = "stroke <img src=x onerror=document.title=1> & more"


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, str]]]:
    """A saved page, and the table of its recording."""
    folder = tmp_path_factory.mktemp("saved")
    (frames := folder / NAME).mkdir()
    rng = np.random.default_rng(21)
    for number in range(FRAMES):
        gap_px = 60.0 + 3.0 * (WIDEST - abs(number - WIDEST))
        picture = render(two_fingers(gap_px, frame=(320, 240)), Camera(blur_px=0.9, noise_grey=1.0), rng)
        cv2.imwrite(str(frames / f"{number:03d}.png"), picture)
    view = Playback(recorded(str(frames), RATE_HZ, Choices(scale=BareScale(PX_PER_MM)), ()), folder / "out")
    with serving(view) as page:
        view.start()
        try:
            until(lambda: view.table is not None)
            view.seek(5)
            asked = ",".join(map(str, PICTURES))
            text = fetched(page.address, f"saved.html?frames={asked}")
            assert view.frame == 5
            for viewer_or_not, wrong in ((page.viewer_address, asked), (page.address, "1,x"), (page.address, "")):
                with pytest.raises(HTTPError):
                    fetched(viewer_or_not, f"saved.html?frames={wrong}")
            assert view.table is not None
            rows = list(csv.DictReader(view.table.read_text(encoding="utf-8").splitlines()))
        finally:
            view.stop()
    (path := folder / "page.html").write_bytes(text)
    return path, rows


def fetched(address: str, path: str) -> bytes:
    server, _, token = address.partition("?")
    with urllib.request.urlopen(f"{server}{path}&{token}") as answer:
        return bytes(answer.read())


@pytest.fixture
def page(saved: tuple[Path, list[dict[str, str]]], browser: Any) -> Iterator[Any]:
    """The file in a browser, which must ask for nothing but the file."""
    context, asked, errors = browser.new_context(viewport={"width": 1280, "height": 720}), [], []
    found = context.new_page()
    found.on("request", lambda each: asked.append(each.url))
    found.on("pageerror", lambda each: errors.append(str(each)))
    found.on("console", lambda each: errors.append(each.text))
    found.goto(saved[0].as_uri())
    yield found
    context.close()
    assert not errors, errors
    assert not [url for url in asked if not url.startswith(("data:", "blob:", saved[0].as_uri()))]


def test_saved_values_are_those_of_the_table_beside_the_picture_of_their_frame(
    page: Any, saved: tuple[Path, list[dict[str, str]]]
) -> None:
    rows = saved[1]
    shown(page, "document.querySelector('#picture').dataset.shown > 0")
    for key, frame in (("End", FRAMES - 1), ("Home", 0), ("ArrowRight", WIDEST), ("End", FRAMES - 1), (",", WIDEST)):
        page.keyboard.press(key)
        shown(page, f"document.querySelector('#gap_mm').dataset.frame === '{frame}'")
        assert float(page.inner_text("#gap_mm")) == pytest.approx(float(rows[frame]["gap_mm"]), abs=6e-5)
        assert page.input_value("#go_frame") == str(frame)
        drawn = page.locator("#overlay .distance").get_attribute("d")
        assert f"M{float(rows[frame]['left_x_px']):.3f} " in drawn
    # A frame whose picture the file has not: the nearest is shown, with its own value.
    page.keyboard.press("n")
    page.keyboard.type("12")
    page.keyboard.press("Enter")
    page.keyboard.press("Escape")
    shown(page, f"document.querySelector('#log').textContent.includes('frame {WIDEST}')")
    assert page.get_attribute("#gap_mm", "data-frame") == str(WIDEST)
    assert page.title() != "1"
    assert NAME in page.inner_text("h1")
    download = downloaded(page, lambda: page.click("#save_seen"))
    seen = list(csv.DictReader(download.read_text(encoding="utf-8").splitlines()))
    assert [float(row["gap_mm"]) for row in seen] == pytest.approx([float(row["gap_mm"]) for row in rows], abs=1e-6)
