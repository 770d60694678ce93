"""The page in Firefox: live view, run folder and recording on three screens, in both colour schemes, no errors."""

import csv
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.live.firefox import Firefox, firefox, needs_firefox

__all__ = ["firefox"]
pytestmark = needs_firefox
SCREENS = ((1280, 720), (1920, 1080), (390, 844))
SCREENSHOTS = os.environ.get("FINGERVISION_SCREENSHOTS")
# What the page shows has four decimals, the table seven.
SHOWN_MM = 0.00005


def on_every_screen(firefox: Firefox, address: str, name: str) -> None:
    """Picture, value, status and chart fit the window, which has the user's colour scheme."""
    for width, height in SCREENS:
        firefox.open(address, (width, height))
        firefox.shown("Number(document.querySelector('#picture').dataset.shown) > 0")
        firefox.shown("/\\d/.test(document.querySelector('#gap_mm').textContent)")
        for part in ("#picture", "#gap_mm", "#status", "#chart"):
            box = firefox.box(part)
            assert 0 <= box["left"] <= box["right"] <= width + 0.5, (name, width, part, box)
            assert 0 <= box["top"] <= box["bottom"] <= height + 0.5, (name, width, part, box)
        assert firefox.evaluate("document.documentElement.scrollWidth") <= width
        is_dark = firefox.evaluate("matchMedia('(prefers-color-scheme: dark)').matches")
        ground = firefox.evaluate("getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)")
        assert (sum(ground) < 3 * 128) is is_dark
        if SCREENSHOTS:
            firefox.screenshot(Path(SCREENSHOTS) / f"firefox_{name}_{width}_{'dark' if is_dark else 'light'}.png")


@pytest.mark.slow
def test_live_a_run_folder_and_a_recording_in_firefox(firefox: Firefox, live: Callable[..., Any]) -> None:
    view = live("simulated", "--port", "0")
    on_every_screen(firefox, view.address, "live")
    firefox.open(view.address)
    firefox.shown("Number(document.querySelector('#picture').dataset.shown) > 5")
    firefox.press("r")
    firefox.shown("document.querySelector('#record').textContent.includes('Stop')")
    before = int(firefox.evaluate("document.querySelector('#gap_mm').dataset.frame"))
    firefox.shown(f"Number(document.querySelector('#gap_mm').dataset.frame) > {before + 20}")
    firefox.press("r")
    firefox.shown("[...document.querySelectorAll('#log li')].some(e => e.textContent.includes('Recorded'))")
    (run,) = view.runs()
    firefox.evaluate("[...document.querySelectorAll('#panels details')].forEach(e => e.open = true) || 0")
    firefox.fill("#below_tip", "-1")
    firefox.shown("[...document.querySelectorAll('#log li')].some(e => e.textContent.includes('-1'))")
    assert view.stop() == 0

    with (run / "gaps.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    (video,) = (each for each in run.iterdir() if each.suffix in (".mp4", ".mkv"))
    for name, source, options in (("run", run, ()), ("recording", video, ("--px-per-mm", "34"))):
        shown = live(source, *options, "--port", "0")
        on_every_screen(firefox, shown.address, name)
        firefox.open(shown.address)
        firefox.shown(f"document.querySelector('#place').textContent === 'frame 0 of {len(rows)}'")
        firefox.press("\ue014")  # arrow to the right
        firefox.shown("document.querySelector('#gap_mm').dataset.frame === '1'")
        found = float(firefox.evaluate("document.querySelector('#gap_mm').textContent"))
        assert found == pytest.approx(float(rows[1]["gap_mm"]), abs=SHOWN_MM)
        assert shown.stop() == 0
