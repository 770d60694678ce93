"""Two recordings side by side: the difference of their gaps is that of the drawn fingers, within its uncertainty."""

from collections.abc import Callable, Iterator
from math import sin, tau
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.cli import cli
from fingervision.domain.errors import UsageError
from fingervision.live.choices import Choices
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import recorded
from fingervision.live.playback.second_recording import SecondRecording, beside_recording
from fingervision.rendering import Camera, render, two_fingers
from tests.live.browser import browser, opened, shown, typed
from tests.live.conftest import serving
from tests.waiting import until

__all__ = ["browser", "opened"]
FRAMES, RATE_HZ, PX_PER_MM = 36, 25.0, 34.0
WIDER_PX, FAULT_PX, FAULTY = 1.7, 3.0, range(26, 32)
# The second recording began so much later: between two of its frames there is one of the first.
LATER_S = 0.5 / RATE_HZ


def gap_px(time_s: float) -> float:
    return 70.0 + 25.0 * sin(tau * time_s / 1.6)


def drawn(folder: Path, gaps_px: list[float], seed: int) -> Path:
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True)
    for number, gap in enumerate(gaps_px):
        picture = render(two_fingers(gap, frame=(320, 240)), Camera(blur_px=0.9, noise_grey=1.5), rng)
        cv2.imwrite(str(folder / f"{number:03}.png"), np.asarray(picture))
    return folder


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A recording, and one of wider gaps that begins later and differs for some frames."""
    folder = tmp_path_factory.mktemp("two")
    healthy = [gap_px(number / RATE_HZ) for number in range(FRAMES)]
    faulty = [
        gap_px(number / RATE_HZ + LATER_S) + WIDER_PX + (FAULT_PX if number in FAULTY else 0.0)
        for number in range(FRAMES)
    ]
    return drawn(folder / "healthy", healthy, 11), drawn(folder / "faulty", faulty, 12)


@pytest.fixture(scope="module")
def views(
    folders: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Playback, SecondRecording]]:
    choices = Choices(scale=BareScale(PX_PER_MM))
    first = Playback(recorded(str(folders[0]), RATE_HZ, choices, ()), tmp_path_factory.mktemp("views") / "out")
    second = beside_recording(str(folders[1]), RATE_HZ, choices, first)
    second.start()
    first.start()
    yield first, second
    first.stop()


def test_difference_is_that_of_the_drawn_fingers(views: tuple[Playback, SecondRecording]) -> None:
    first, second = views
    until(lambda: first.table is not None and second.table is not None)
    before = first.identity
    second.shift(LATER_S)
    assert first.identity != before  # all rows are sent anew
    rows = list(first.rows(0, FRAMES))
    found = second.differences(rows)
    known = [(row, each) for row, each in zip(rows, found, strict=True) if each is not None]
    assert len(known) == FRAMES - 1  # the second recording begins half a frame later
    around = [number for number in range(FRAMES) if not {number - 1, number, number - 2, number + 1} & set(FAULTY)]
    errors = []
    for row, (beside_mm, u_mm) in known:
        assert row.gap_mm is not None
        if row.frame in around:
            errors.append((row.gap_mm - beside_mm + WIDER_PX / PX_PER_MM) / u_mm)
            assert abs(row.gap_mm - beside_mm) * PX_PER_MM == pytest.approx(WIDER_PX, abs=0.6)
    assert len(errors) > 0.7 * FRAMES
    assert max(map(abs, errors)) < 4.0
    inside = dict(zip([row.frame for row, _ in known], [row.gap_mm - each[0] for row, each in known], strict=True))
    assert inside[29] * PX_PER_MM == pytest.approx(-WIDER_PX - FAULT_PX, abs=0.6)


@pytest.mark.parametrize("more", [("--model", "model.csv"), ("--as-camera",)])
def test_a_second_recording_is_refused_where_it_cannot_be_shown(
    folders: tuple[Path, Path], more: tuple[str, ...]
) -> None:
    given = [str(folders[0]), "--rate-hz", "25", "--px-per-mm", "34", "--beside", str(folders[1]), *more]
    with pytest.raises(UsageError):
        cli.main(["live", *given], standalone_mode=False)


def test_page_shows_both_recordings_and_where_they_differ_most(
    views: tuple[Playback, SecondRecording], opened: Callable[..., Any]
) -> None:
    first, second = views
    second.shift(LATER_S)
    until(lambda: first.table is not None and second.table is not None)
    with serving(first) as served:
        page = opened(served.address, viewport={"width": 1280, "height": 720})
        shown(page, "!document.querySelector('#beside').hidden")
        shown(page, "document.querySelector('#second_picture').naturalWidth === 320")
        shown(page, "!document.querySelector('#residual_chart').hidden")
        page.wait_for_timeout(500)
        page.keyboard.press("w")
        shown(page, "Number(document.querySelector('#gap_mm').dataset.frame) >= 26")
        shown(page, "Number(document.querySelector('#gap_mm').dataset.frame) <= 32")
        shown(page, "document.querySelector('#readout').textContent.includes('difference')")
        typed(page, "#second_offset", "nonsense")
        shown(page, "document.querySelector('#shift_form + .refused').textContent !== ''")


# The last one, because it changes the scale of the views that all tests share.
def test_second_recording_follows_the_first_and_its_settings(views: tuple[Playback, SecondRecording]) -> None:
    first, second = views
    second.shift(0.0)
    first.seek(31)
    until(lambda: second.seen is not None and second.seen.frame.index == 31)
    second.shift(4.0 / RATE_HZ)
    until(lambda: second.seen is not None and second.seen.frame.index == 27)
    first.choose(scale=BareScale(17.0))
    assert second.choices.scale is first.choices.scale
