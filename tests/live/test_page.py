"""The page in a real browser: Debian's Chromium, controlled by Playwright."""

import csv
import io
import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fingervision.live.page_socket import STATE_EVERY_S
from fingervision.live.session import SILENT_S
from tests.live.browser import PATIENCE_MS, browser, downloaded, drag, opened, says, shown, typed

__all__ = ["browser", "opened"]
from tests.waiting import until

# What the page shows has four decimals, the table seven.
SHOWN_MM = 0.00005
BAR_PX, BAR_MM = 136, 4.0
SAID_WITHIN_S = 1.0


def no_value_is_left(page: Any, status: str) -> None:
    """Without frames, the page shows no value and no green status, but the reason."""
    shown(page, f"document.querySelector('#status').textContent === '{status}'")
    assert not re.search(r"\d", page.inner_text("#gap_mm"))
    assert page.get_attribute("#status", "class") == "badge bad"
    assert page.locator("#verdict").is_hidden()
    box = page.locator("#alarm").bounding_box()
    assert box is not None
    assert box["y"] + box["height"] <= page.viewport_size["height"]


@pytest.mark.slow
def test_the_page_shows_records_and_saves(
    live: Callable[..., Any], opened: Callable[..., Any], measured: Callable[..., str]
) -> None:
    view = live("simulated", "--port", "0")
    page = opened(view.address)
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 10")
    first = page.inner_text("#gap_mm")
    shown(page, f"document.querySelector('#gap_mm').textContent !== '{first}'")
    assert page.inner_text("#status") == "ok"

    # What is shown is what the table holds.
    page.click("#pause")
    gap_mm, frame = float(page.inner_text("#gap_mm")), int(page.get_attribute("#gap_mm", "data-frame"))
    saved = downloaded(page, lambda: page.click("#save_csv"))
    table = {int(row["frame"]): row for row in csv.DictReader(io.StringIO(saved.read_text()))}
    assert float(table[frame]["gap_mm"]) == pytest.approx(gap_mm, abs=SHOWN_MM)
    page.click("#pause")

    plot = downloaded(page, lambda: page.click("#save_plot"))
    assert cv2.imread(str(plot)).std() > 1.0

    # Keyboard: record, and stop again.
    page.locator("body").press("r")
    shown(page, "document.querySelector('#record').textContent === 'Stop'")
    typed(page, "#below_tip", "0.4")
    says(page, "The settings of the measurement cannot be changed while a run is recorded")
    page.press("#below_tip", "Escape")
    shown(page, "/Recording: [3-9][0-9] frames/.test(document.querySelector('#recording').textContent)")
    page.locator("body").press("r")
    says(page, " frames to ")
    (run,) = view.runs()
    assert measured(run / "video.mp4", "--px-per-mm", "34") == (run / "gaps.csv").read_text()

    page.click("#snapshot")
    says(page, "Snapshot of frame")
    (snapshot,) = view.out.glob("snapshot_*.png")
    assert cv2.imread(str(snapshot), cv2.IMREAD_UNCHANGED).shape == (480, 640)

    page.click("#steps")
    page.locator("#step_pictures img").nth(5).wait_for()
    shown(page, "[...document.querySelectorAll('#step_pictures img')].every(i => i.naturalWidth === 640)")
    names = page.locator("#step_pictures figcaption").all_inner_texts()
    assert names[:3] == ["grey", "denoised", "binary"]

    page.fill("#least", "0.5")
    typed(page, "#greatest", "5")
    page.locator("#verdict", has_text="pass").wait_for()
    page.click("#zero")
    page.locator("#unzero").wait_for()
    page.click("#unzero")

    # A region by mouse: one finger alone is no gap; the whole picture is one again.
    page.click("#drag_region")
    drag(page, (60, 60, 180, 400))
    shown(page, "document.querySelector('#status').textContent !== 'ok'")
    page.click("#whole")
    shown(page, "document.querySelector('#status').textContent === 'ok'")


def under_cursor_s(page: Any, share: float) -> float:
    """Time in the chart's legend with the cursor at a given share of the chart's width."""
    box = page.locator("#chart .u-over").bounding_box()
    page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
    page.wait_for_function("() => document.querySelector('#readout').dataset.time")
    return float(page.get_attribute("#readout", "data-time"))


@pytest.mark.slow
def test_the_chart_zooms_and_every_key_and_limit_does_what_it_says(
    live: Callable[..., Any], opened: Callable[..., Any]
) -> None:
    view = live("simulated", "--port", "0")
    page = opened(view.address)
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 60")

    # The cursor reads the chart, a drag with Shift zooms in, what comes in does not move it, and a key follows again.
    page.locator("#chart").scroll_into_view_if_needed()
    began_s, newest_s = under_cursor_s(page, 0.01), under_cursor_s(page, 0.99)
    box = page.locator("#chart .u-over").bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.4 * box["width"], middle)
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], middle, steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    zoomed_s = (under_cursor_s(page, 0.02), under_cursor_s(page, 0.98))
    assert began_s < zoomed_s[0] < zoomed_s[1] < newest_s
    page.wait_for_timeout(500)
    assert (under_cursor_s(page, 0.02), under_cursor_s(page, 0.98)) == zoomed_s
    page.locator("body").press("f")
    shown(page, "document.querySelector('#follow').textContent === 'Follow'")
    until(lambda: under_cursor_s(page, 0.99) > newest_s, within_s=PATIENCE_MS / 1e3)

    # Where the tips cannot point there is no gap.
    page.select_option("#tips", "left")
    shown(page, "document.querySelector('#status').textContent !== 'ok'")
    page.select_option("#tips", "up")
    shown(page, "document.querySelector('#status').textContent === 'ok'")

    # The simulated gripper moves between 1 and 4 mm.
    for least, greatest, verdict in (("5", "6", "fail"), ("0.5", "5", "pass")):
        page.fill("#least", least)
        typed(page, "#greatest", greatest)
        page.locator("#verdict", has_text=verdict).wait_for()
    typed(page, "#least", "7")
    says(page, "The lower limit must be below the upper limit, but the limits are 7 and 5 mm.")
    page.press("#least", "Escape")

    page.locator("body").press("z")
    says(page, "Displayed gaps are reduced by")
    off_mm = float(re.search(r"reduced by ([\d.]+) mm", page.locator("#log li", has_text="reduced by").inner_text())[1])
    page.locator("#unzero").wait_for()
    page.locator("body").press("p")
    assert page.inner_text("#pause") == "Go on"
    shown_mm, frame = float(page.inner_text("#gap_mm")), int(page.get_attribute("#gap_mm", "data-frame"))
    saved = downloaded(page, lambda: page.click("#save_csv"))
    table = {int(row["frame"]): row for row in csv.DictReader(io.StringIO(saved.read_text()))}
    assert float(table[frame]["gap_mm"]) - off_mm == pytest.approx(shown_mm, abs=2 * SHOWN_MM)
    page.wait_for_timeout(300)
    assert int(page.get_attribute("#gap_mm", "data-frame")) == frame
    page.locator("body").press("p")
    shown(page, f"Number(document.querySelector('#gap_mm').dataset.frame) > {frame}")

    page.locator("body").press("s")
    says(page, "Snapshot of frame")
    page.locator("body").press("i")
    page.locator("#step_pictures img").first.wait_for()
    # Every control can be reached without a mouse, and shows that it is.
    page.locator("#pause").focus()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "record"
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"


@pytest.mark.slow
def test_a_scale_is_asked_for_and_found_on_a_reference(
    live: Callable[..., Any], opened: Callable[..., Any], tmp_path: Path
) -> None:
    picture = np.full((480, 640), 200, np.uint8)
    picture[60:420, 250 : 250 + BAR_PX] = 40
    folder = tmp_path / "bar"
    folder.mkdir()
    blurred = cv2.GaussianBlur(picture, (0, 0), 1.2).astype(float)
    rng = np.random.default_rng(5)
    for index in range(200):
        noisy = np.clip(blurred + rng.normal(0.0, 2.0, picture.shape), 0, 255).astype(np.uint8)
        cv2.imwrite(str(folder / f"{index:03d}.png"), noisy)
    view = live(folder, "--as-camera", "--rate-hz", "10", "--port", "0")
    page = opened(view.address)
    page.locator("#alarm", has_text="The scale is not known").wait_for()
    page.locator("body").press("r")
    says(page, "The scale is not known: give the scale before recording")
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 2")
    page.click("#drag_reference")
    drag(page, (200, 100, 240, 280))
    typed(page, "#size_mm", str(BAR_MM))
    says(page, "Calibrated: ")
    (calibration,) = view.out.glob("calibration_*.json")
    found = json.loads(calibration.read_text())
    # A hundredth of a pixel over the bar's width, as the edges can be found.
    assert found["px_per_mm"] == pytest.approx(BAR_PX / BAR_MM, abs=0.02)
    shown(page, "document.querySelector('#scale').textContent.includes('±')")


@pytest.mark.slow
def test_the_page_fits_a_phone_and_comes_back_after_a_restart(
    live: Callable[..., Any], opened: Callable[..., Any], tmp_path: Path
) -> None:
    out = tmp_path / "kept"
    view = live("simulated", "--port", "0", out=out)
    address = view.address
    page = opened(address, viewport={"width": 390, "height": 844}, color_scheme="dark")
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 5")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert max(int(level) for level in re.findall(r"\d+", ground)) < 64
    assert view.stop() == 0
    page.locator("#connection", has_text="does not answer").wait_for()
    no_value_is_left(page, "not connected")
    again = live("simulated", "--port", re.search(r":(\d+)/", address)[1], out=out)
    assert again.address == address
    page.locator("#connection", has_text="connected").wait_for()
    before = int(page.get_attribute("#picture", "data-shown"))
    shown(page, f"Number(document.querySelector('#picture').dataset.shown) > {before + 5}")


@pytest.mark.slow
def test_a_cut_is_said_within_a_second_and_measuring_resumes(
    live: Callable[..., Any], opened: Callable[..., Any], camera: Any
) -> None:
    view = live(camera.address, "--px-per-mm", "34", "--port", "0")
    page = opened(view.address)
    shown(page, "document.querySelector('#status').textContent === 'ok'")
    shown(page, "document.querySelector('#alarm').hidden")
    camera.stop()
    page.locator("#alarm", has_text="No picture for").wait_for()
    no_value_is_left(page, "no picture")
    # How soon is counted by the program, and not by a browser that waits for a busy machine.
    assert SILENT_S + STATE_EVERY_S < SAID_WITHIN_S
    camera.start()
    says(page, "The source is back")
    shown(page, "document.querySelector('#alarm').hidden && Number(document.querySelector('#gap_mm').textContent) > 0")


@pytest.mark.slow
def test_a_recording_that_ends_by_itself_is_in_view(
    live: Callable[..., Any], opened: Callable[..., Any], tmp_path: Path
) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(disk)], capture_output=True, text=True, check=False
    )
    if mounted.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {mounted.stderr.strip()}")
    try:
        view = live("simulated", "--port", "0", out=disk / "runs")
        page = opened(view.address, viewport={"width": 1280, "height": 800})
        shown(page, "Number(document.querySelector('#picture').dataset.shown) > 5")
        chart = page.locator("#chart").bounding_box()
        assert chart["y"] + chart["height"] <= 800  # the chart is in view
        page.locator("body").press("r")
        page.locator("#alarm", has_text="Recording has ended").wait_for()
        box = page.locator("#alarm").bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= 800
        assert page.locator("#alarm", has_text="No space left on device").is_visible()
        assert page.inner_text("#record") != "Stop"
        page.wait_for_timeout(500)  # it stays, and measuring goes on
        assert page.locator("#alarm", has_text="Recording has ended").is_visible()
        assert view.stop() == 1
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
