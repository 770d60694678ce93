"""The page of a recording in a browser: zoom, overlay, ruler, frames that are typed, graph, and typed numbers."""

from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event, Thread
from typing import Any

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.live.choices import Choices
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import recorded
from fingervision.live.server import Page, bound
from fingervision.rendering import Camera, render, two_fingers
from tests.live.browser import browser, needs_chromium, opened, shown

__all__ = ["browser", "opened"]
pytestmark = [needs_chromium, pytest.mark.slow]
FRAMES, RATE_HZ, PX_PER_MM = 40, 25.0, 34.0
TIMES = "\N{MULTIPLICATION SIGN}"
WIDEST, HIDDEN = 20, (28, 31)
WHOLE = f"document.querySelector('#place').textContent.endsWith('of {FRAMES}')"


def gap_px(number: int) -> float:
    """The gap opens until frame `WIDEST`, and closes again."""
    return 60.0 + 3.0 * (WIDEST - abs(number - WIDEST))


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pictures of a stroke there and back, some of them hidden by a hand."""
    folder = tmp_path_factory.mktemp("stroke") / "frames"
    folder.mkdir()
    rng = np.random.default_rng(11)
    for number in range(FRAMES):
        picture = render(two_fingers(gap_px(number), frame=(320, 240)), Camera(blur_px=0.9, noise_grey=1.0), rng)
        if HIDDEN[0] <= number <= HIDDEN[1]:
            picture[:] = 128
        cv2.imwrite(str(folder / f"{number:03d}.png"), picture)
    return folder


@pytest.fixture
def served(frames: Path, tmp_path: Path) -> Iterator[str]:
    """Address of the page of the recording."""
    view = Playback(recorded(str(frames), RATE_HZ, Choices(scale=BareScale(PX_PER_MM)), ()), tmp_path / "out")
    page, end = Page(view, bound("127.0.0.1", 0)), Event()
    view.start()
    serving = Thread(target=page.serve, args=(end,), daemon=True)
    serving.start()
    yield page.address
    end.set()
    serving.join()
    view.stop()


def typed(page: Any, field: str, words: str) -> None:
    page.fill(field, words)
    page.press(field, "Enter")


def is_at(page: Any, number: int) -> None:
    shown(page, f"document.querySelector('#gap_mm').dataset.frame === '{number}'")


def drawn_gap_px(page: Any) -> float:
    """Length of the drawn distance between the measuring points, in pixels of the picture, from where it is seen."""
    line = page.locator("#overlay .distance").bounding_box()
    picture = page.locator("#picture").bounding_box()
    return float(line["width"] / picture["width"] * page.evaluate("document.querySelector('#picture').width"))


def test_picture_zooms_with_its_overlay_and_frames_are_found_by_number_time_and_mark(
    served: str, opened: Callable[..., Any]
) -> None:
    page = opened(served, viewport={"width": 1280, "height": 720})
    shown(page, WHOLE)
    frame = page.locator("#frame").bounding_box()

    # A number and a time that are typed, also with a comma; what cannot be understood gives way to what is shown.
    typed(page, "#go_frame", "17")
    is_at(page, 17)
    for words, number in (("1.2", 30), ("0,24", 6), ("99", FRAMES - 1)):
        typed(page, "#go_time", words)
        is_at(page, number)
    typed(page, "#go_frame", "the third")
    page.locator("#alarm", has_text="must be a number").wait_for()
    assert page.input_value("#go_frame") == str(FRAMES - 1)
    assert page.locator("#frame").bounding_box() == frame  # an alarm takes nothing from the picture

    # The overlay stays on the edges at any zoom.
    page.press("#go_frame", "Escape")
    page.locator("body").press("Home")
    is_at(page, 0)
    for zoom in (1.0, 4.0):
        found_px = float(page.inner_text("#gap_mm")) * PX_PER_MM
        assert drawn_gap_px(page) == pytest.approx(found_px, abs=0.1)
        points = page.locator("#overlay .distance").bounding_box()
        page.mouse.move(points["x"] + points["width"] / 2, points["y"])
        before = points["x"] + points["width"] / 2
        while zoom == 1.0 and float(page.inner_text("#zoom_words")[:-1]) < 4.0:
            page.mouse.wheel(0, -100)
        # What was under the pointer stays there.
        after = page.locator("#overlay .distance").bounding_box()
        assert after["x"] + after["width"] / 2 == pytest.approx(before, abs=1.0)
    line_px = page.locator("#overlay .distance").evaluate("line => getComputedStyle(line).vectorEffect")
    assert line_px == "non-scaling-stroke"
    page.locator("body").press("l")
    assert page.locator(".lens:visible").count() == 2
    # The edge crosses each magnifier: one side of it is a finger.
    sides = page.locator("#lens_left").evaluate(
        "lens => [0.03, 0.97].map(share => lens.getContext('2d').getImageData(share * 320, 160, 1, 1).data[0])"
    )
    assert sides[1] - sides[0] > 60
    # A drag moves the enlarged picture, by as much as the pointer; a key fits it again.
    at = page.locator("#picture").bounding_box()
    x, y = frame["x"] + frame["width"] / 2, frame["y"] + frame["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y + 20, steps=3)
    page.mouse.up()
    moved = page.locator("#picture").bounding_box()
    assert (moved["x"] - at["x"], moved["y"] - at["y"]) == pytest.approx((30, 20), abs=1.0)
    page.locator("body").press("0")
    assert page.inner_text("#zoom_words") == f"1.0{TIMES}"
    page.locator("#frame").focus()
    page.keyboard.press("+")
    assert page.inner_text("#zoom_words") == f"1.5{TIMES}"
    page.locator("body").press("0")

    # The ruler's marks: the widest gap, and the first frame that a hand hides.
    page.evaluate("document.activeElement.blur()")
    marks = []
    for _ in range(2):
        page.locator("body").press(".")
        shown(page, f"document.querySelector('#gap_mm').dataset.frame !== '{marks[-1] if marks else 0}'")
        marks.append(int(page.get_attribute("#gap_mm", "data-frame")))
    assert marks == [WIDEST, HIDDEN[0]]
    page.locator("body").press(",")
    is_at(page, WIDEST)
    assert "1 turning points, 1 stretches without a gap" in page.get_attribute("#scrub", "aria-label")

    # From a tenth to eight times the speed.
    speeds = [float(each.rstrip(TIMES)) for each in page.locator("#speed option").all_inner_texts()]
    assert {0.1, 1.0, 8.0} <= set(speeds)
    page.select_option("#speed", "8")
    page.click("#play")
    is_at(page, FRAMES - 1)
    assert page.locator("#frame").bounding_box() == frame
