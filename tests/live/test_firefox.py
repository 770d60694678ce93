"""The page in a second kind of browser: all three ways in, on every size of screen, in both schemes of colours."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fingervision.rendering import Camera, render, two_fingers
from tests.live.firefox import DARK, LIGHT, Firefox, firefox, needs_firefox

pytestmark = [needs_firefox, pytest.mark.slow]
SIZES = ((390, 844), (1280, 720), (1920, 1080))
# The page's own server, and what it holds itself.
OWN = ("http://127.0.0.1:", "ws://127.0.0.1:", "blob:http://127.0.0.1:", "data:", "about:")
PARTS = ("#picture", "#gap_mm", "#status", "#chart")


RECIPE = """\
schema = 1
name = "there and back"

[[step]]
kind = "triangle"
from_mm = 0.0
to_mm = 0.3
speed_mm_s = 0.5
cycles = 1
frames = "continuous"
"""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("firefox") / "opening"
    folder.mkdir()
    rng = np.random.default_rng(11)
    for index in range(20):
        picture = render(two_fingers(90.0 + index, radius_px=20.0), Camera(blur_px=0.9, noise_grey=2.0), rng)
        cv2.imwrite(str(folder / f"{index:03d}.png"), picture)
    return folder


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bed")
    (folder / "recipe.toml").write_text(RECIPE)
    words = [sys.executable, "-m", "fingervision", "bed", "run", "recipe.toml", "--out", "run", "--seed", "3"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    subprocess.run(words, cwd=folder, check=True, capture_output=True, env=environment)
    return folder / "run"


def is_whole(browser: Firefox, width: int, height: int) -> None:
    """Picture, value, status and chart lie in view, one beside or below the other."""
    boxes = json.loads(
        browser.value(
            f"JSON.stringify({list(PARTS)}.map(part => {{ const box = document.querySelector(part)"
            ".getBoundingClientRect(); return [box.left, box.top, box.right, box.bottom]; }))"
        )
    )
    for part, (left, top, right, bottom) in zip(PARTS, boxes, strict=True):
        assert 0 <= left < right <= width, (part, width, left, right)
        assert 0 <= top < bottom <= height, (part, height, top, bottom)
    assert browser.value("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(("name", "scheme"), [("light", LIGHT), ("dark", DARK)])
def test_all_three_ways_in_are_whole_at_every_size(
    live: Callable[..., Any], recording: Path, run_folder: Path, tmp_path: Path, name: str, scheme: str
) -> None:
    ways = {
        "live": live("simulated", "--port", "0"),
        "recording": live(recording, "--rate-hz", "25", "--px-per-mm", "34", "--port", "0"),
        "run": live(run_folder, "--px-per-mm", "34", "--port", "0"),
    }
    pictures = Path(os.environ.get("FINGERVISION_SCREENSHOTS", tmp_path))
    pictures.mkdir(parents=True, exist_ok=True)
    with firefox(tmp_path / "profile", scheme) as browser:
        for way, view in ways.items():
            for width, height in SIZES:
                browser.open(view.address, width, height)
                browser.until("document.querySelector('#gap_mm').textContent.match(/[0-9]\\.[0-9]/) !== null")
                browser.until("document.querySelector('#picture').width > 100")
                is_whole(browser, width, height)
                browser.picture(pictures / f"firefox_{way}_{width}_{name}.png")
            is_dark = browser.value("matchMedia('(prefers-color-scheme: dark)').matches")
            assert is_dark == (scheme == DARK)
            if way == "live":
                browser.press(" ")
                browser.until("document.querySelector('#pause').textContent === 'Go on'")
        assert browser.logged == []
        assert browser.asked_for
        foreign = [url for url in browser.asked_for if not url.startswith(OWN)]
        assert foreign == []
