"""Layout of the page on every screen size: what fits, what can be reached, and results of an accessibility checker."""

import re
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread
from typing import Any

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.live.beside import Beside, stand_beside
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.rendering import Camera, render, two_fingers
from tests.csv_rows import csv_rows
from tests.live.browser import browser, downloaded, keep, opened, says, shown, typed
from tests.live.test_camera_controls import AllControls

__all__ = ["browser", "opened"]
pytestmark = [pytest.mark.slow]
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
WIDTHS, SCHEMES = ((390, 844), (1280, 720), (1920, 1080)), ("light", "dark")
PHONE_ACROSS = (844, 390)
# Chart and colours follow the window and the scheme within this.
DRAWN_MS = 300
# What reaches beyond the window's right side.
TOO_WIDE = """[...document.querySelectorAll("body *")]
.filter(each => each.getBoundingClientRect().right > innerWidth + 1).map(each => `${each.tagName} ${each.id}`)"""
CYCLE = 40
# What the page shows has four decimals, the table seven.
SHOWN_MM = 0.00005


def findings(page: Any) -> list[str]:
    """Findings of axe-core at level AA and for its best practices."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed.")
    found = axe.Axe().run(page, options={"runOnly": {"type": "tag", "values": RULES}}).response["violations"]
    return [f"{each['id']}: {each['help']} {[node['html'][:150] for node in each['nodes']]}" for each in found]


@pytest.fixture
def covered(tmp_path: Path) -> Path:
    """Pictures of a gripper that a hand hides for a while, so that some frames have no fingers."""
    folder = tmp_path / "covered"
    folder.mkdir()
    rng = np.random.default_rng(7)
    for index in range(CYCLE):
        picture = render(two_fingers(90.0 + index, radius_px=20.0), Camera(blur_px=0.9, noise_grey=2.0), rng)
        if 15 <= index < 25:
            picture[:] = 128
        cv2.imwrite(str(folder / f"{index:03d}.png"), picture)
    return folder


def look_on_every_screen(opened: Callable[..., Any], address: str, name: str) -> None:
    """Picture, value, status and chart fit the window, which has the user's colour scheme."""
    for scheme in SCHEMES:
        page = opened(address, color_scheme=scheme)
        shown(page, "Number(document.querySelector('#picture').dataset.shown) > 0")
        shown(page, r"/\d/.test(document.querySelector('#gap_mm').textContent)")
        for width, height in (*WIDTHS, PHONE_ACROSS):
            page.set_viewport_size({"width": width, "height": height})
            page.wait_for_timeout(DRAWN_MS)
            for part in ("#picture", "#gap_mm", "#status", "#chart"):
                box = page.locator(part).bounding_box()
                assert 0 <= box["x"] <= box["x"] + box["width"] <= width + 0.5, (name, width, part, box)
                assert 0 <= box["y"] <= box["y"] + box["height"] <= height + 0.5, (name, width, part, box)
                assert box["height"] > (80 if part in ("#picture", "#chart") else 10), (name, width, part, box)
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
            assert (sum(map(int, re.findall(r"\d+", ground))) < 3 * 128) is (scheme == "dark")
            keep(page, f"{name}_{width}_{scheme}")
        page.close()


def test_live_a_run_folder_and_a_recording_fit_every_screen(
    live: Callable[..., Any], opened: Callable[..., Any]
) -> None:
    view = live("simulated", "--port", "0")
    look_on_every_screen(opened, view.address, "live")
    page = opened(view.address)
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 5")
    page.locator("body").press("r")
    shown(page, "/: [2-9][0-9] frames/.test(document.querySelector('#recording').textContent)")
    page.locator("body").press("r")
    says(page, "Recorded")
    page.close()
    (run,) = view.runs()
    assert view.stop() == 0
    rows = csv_rows(run / "gaps.csv")
    for name, source, options in (("run", run, ()), ("recording", run / "video.mp4", ("--px-per-mm", "34"))):
        address = live(source, *options, "--port", "0").address
        look_on_every_screen(opened, address, name)
        page = opened(address)
        shown(page, f"document.querySelector('#place').textContent === 'frame 0 of {len(rows)}'")
        page.locator("body").press("ArrowRight")
        shown(page, "document.querySelector('#gap_mm').dataset.frame === '1'")
        assert float(page.inner_text("#gap_mm")) == pytest.approx(float(rows[1]["gap_mm"]), abs=SHOWN_MM)
        page.close()


def open_every_panel(page: Any) -> None:
    page.evaluate("for (const each of document.querySelectorAll('#panels details')) each.open = true")


def check_on_every_screen(page: Any, name: str) -> None:
    """Check the page with axe in every width."""
    for width, height in WIDTHS:
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(DRAWN_MS)
        keep(page, f"{name}_{width}")
        assert findings(page) == [], (name, width)
        scrolled = page.evaluate("document.documentElement.scrollWidth")
        assert scrolled <= width, (name, width, page.evaluate(TOO_WIDE))


def test_axe_finds_nothing_beside_a_camera_with_all_controls_a_model_and_gauges(
    opened: Callable[..., Any], tmp_path: Path
) -> None:
    model = tmp_path / "model.csv"
    model.write_text("input_mm,gap_mm\n-1,1\n2,10\n")
    session = Session(Capture(AllControls(), again=None), Choices(scale=BareScale(34.0)), tmp_path / "out")
    stand_beside(session, Beside(model=model, gauges=tmp_path / "gauges.toml"))
    served, end = Page(session, bound("127.0.0.1", 0)), Event()
    session.start()
    Thread(target=served.serve, args=(end,), daemon=True).start()
    try:
        for scheme in SCHEMES:
            page = opened(served.address, color_scheme=scheme)
            shown(page, "document.querySelectorAll('#camera_controls form').length === 5")
            page.evaluate("document.querySelector('#set_up').open = true")
            if scheme == SCHEMES[0]:  # the other page looks on
                # What was refused is shown as well.
                for number in range(5):
                    typed(page, f"#camera_{number}", "-1e9")
                    shown(page, f"document.querySelector('#camera_words_{number}').textContent.length > 20")
            open_every_panel(page)
            check_on_every_screen(page, f"camera_{scheme}")
            page.locator("h1").click()
            page.locator("body").press("?")
            page.locator("#help_dialog").wait_for()
            assert findings(page) == []
            page.close()
    finally:
        end.set()
        session.stop()


def test_axe_finds_nothing_beside_a_bed_and_on_a_recording(
    live: Callable[..., Any], opened: Callable[..., Any], covered: Path
) -> None:
    bed = ("simulated", "--bed", "simulated", "--allow-motion")
    for name, source in (("bed", bed), ("covered", (covered, "--rate-hz", "20", "--px-per-mm", "34"))):
        address = live(*source, "--port", "0").address
        for scheme in SCHEMES:
            page = opened(address, color_scheme=scheme)
            shown(page, "Number(document.querySelector('#picture').dataset.shown) > 0")
            open_every_panel(page)
            check_on_every_screen(page, f"{name}_{scheme}")
            page.close()


def test_every_control_is_reached_by_tab_and_every_key_is_in_the_help(
    live: Callable[..., Any], opened: Callable[..., Any]
) -> None:
    page = opened(live("simulated", "--port", "0").address)
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 5")
    open_every_panel(page)
    wanted = set(
        page.evaluate(
            "[...document.querySelectorAll('button, input, select, summary')]"
            ".filter(e => e.offsetParent && !e.disabled).map((e, i) => { e.dataset.stop = i; return String(i); })"
        )
    )
    reached = set()
    for _ in range(3 * len(wanted)):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.dataset.stop"))
    assert wanted <= reached
    page.keyboard.press("Escape")
    page.locator("body").press("?")
    page.locator("#help_dialog").wait_for()
    keys = page.locator("#help_keys kbd").all_inner_texts()
    assert {"Space", "←", "→", "↑", "↓", "z", "r", "s", "?", "Escape"} <= set(keys)
    page.keyboard.press("Escape")
    page.locator("#help_dialog").wait_for(state="hidden")
    page.locator("body").press(" ")
    assert page.inner_text("#pause") == "Go on"
    page.locator("body").press(" ")
    # Arrows read the chart sample by sample.
    page.locator("body").press("ArrowLeft")
    first = page.inner_text("#readout")
    page.locator("body").press("ArrowLeft")
    assert page.inner_text("#readout") != first
    assert page.inner_text("#announcer") == page.inner_text("#readout")
    assert "mm" in first


def test_failures_are_marked_on_the_chart_with_their_reason(
    live: Callable[..., Any], opened: Callable[..., Any], covered: Path
) -> None:
    view = live(covered, "--rate-hz", "20", "--px-per-mm", "34", "--port", "0")
    page = opened(view.address)
    shown(page, f"document.querySelector('#place').textContent === 'frame 0 of {CYCLE}'")
    marked = page.evaluate(
        "import('/page/chart_failures.js').then(m => m.failures(-1, 1e9).map(f => [f.status, f.count]))"
    )
    assert len(marked) == 1
    assert marked[0][1] == 10
    # The mark is drawn where it stands in time, and nowhere else: hatched bars at the foot of the chart.
    page.wait_for_timeout(400)
    box = page.locator("#chart .u-over").bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + box["height"] / 2)
    shown(page, "document.querySelector('#readout').textContent.includes('no gap: ')")
    assert marked[0][0].replace("_", " ") in page.inner_text("#readout")
    plot = downloaded(page, lambda: page.locator("body").press("g"))
    picture = cv2.imread(str(plot)).astype(int)
    red = (picture[:, :, 2] - picture[:, :, 1] > 80).any(axis=0).nonzero()[0] / picture.shape[1]
    assert 0.3 < red.min() < 0.5 < red.max() < 0.75
    # Its words begin where it begins: to the left of it there is nothing red.
    foot = (picture[:, :, 2] - picture[:, :, 1] > 80).sum(axis=0)
    assert red.min() >= foot.argmax() / picture.shape[1] - 0.02
    says(page, "The plot was saved")


def test_who_wants_no_motion_gets_a_chart_that_moves_once_a_second(
    live: Callable[..., Any], opened: Callable[..., Any]
) -> None:
    page = opened(live("simulated", "--port", "0").address, reduced_motion="reduce")
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 5")
    page.evaluate(
        "import('/page/bus.js').then(m => { window.drawings = 0; m.listen('drawn', () => { window.drawings += 1; }); })"
    )
    page.wait_for_timeout(3000)
    assert page.evaluate("window.drawings") <= 5
