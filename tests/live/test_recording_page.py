"""The page of a recording in a browser: zoom, overlay, ruler, frames that are typed, graph, and typed numbers."""

import csv
import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.live.choices import Choices
from fingervision.live.comparison.comparison import Comparison
from fingervision.live.playback import track
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import recorded
from fingervision.measuring.scale import stated_scale
from fingervision.rendering import Camera, render, two_fingers
from fingervision.storage.calibration_json import read_calibration
from tests.live.browser import browser, downloaded, drag, opened, says, shown, typed
from tests.live.conftest import serving

__all__ = ["browser", "opened"]
pytestmark = [pytest.mark.slow]
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


@pytest.fixture(autouse=True)
def measured_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The table is waited for: the program that measures gives way to nobody."""
    monkeypatch.setattr(track, "WAITED_FOR", -20)


@pytest.fixture
def served(frames: Path, tmp_path: Path) -> Iterator[str]:
    """Address of the page of the recording."""
    view = Playback(recorded(str(frames), RATE_HZ, Choices(scale=BareScale(PX_PER_MM)), ()), tmp_path / "out")
    with serving(view) as page:
        view.start()
        yield page.address
        view.stop()


def is_at(page: Any, number: int) -> None:
    shown(page, f"document.querySelector('#gap_mm').dataset.frame === '{number}'")


ENDS = """line => [0, line.getTotalLength()].map(at => line.getPointAtLength(at).matrixTransform(line.getScreenCTM()))
.map(point => [point.x, point.y])"""


def measured_points(page: Any) -> list[tuple[float, float]]:
    """Where the two measuring points are drawn in the window."""
    return [(x, y) for x, y in page.locator("#overlay .distance").evaluate(ENDS)]


def drawn_gap_px(page: Any) -> float:
    """Length of the drawn distance between the measuring points, in pixels of the picture, from where it is seen."""
    (left, _), (right, _) = measured_points(page)
    picture = page.locator("#picture").bounding_box()
    return float((right - left) / picture["width"] * page.evaluate("document.querySelector('#picture').width"))


def under(page: Any, x: float, y: float) -> tuple[float, float]:
    """Place of the picture, in its pixels, at a point of the window."""
    box = page.locator("#picture").evaluate(
        "each => { const b = each.getBoundingClientRect(); return [b.x, b.y, b.width / each.width]; }"
    )
    return ((x - box[0]) / box[2], (y - box[1]) / box[2])


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
        # The field, in which the cursor still stands, says what is shown.
        shown(page, f"document.querySelector('#go_time').value === '{number / RATE_HZ:.3f}'")
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
        assert drawn_gap_px(page) == pytest.approx(found_px, abs=0.02)
        if zoom == 1.0:
            (left, top), (right, _) = measured_points(page)
            x, y = round((left + right) / 2), round(top)
            page.mouse.move(x, y)
            before = under(page, x, y)
            while float(page.inner_text("#zoom_words")[:-1]) < 4.0:
                page.mouse.wheel(0, -100)
            # What was under the pointer stays there, to a twentieth of a pixel of the picture.
            assert under(page, x, y) == pytest.approx(before, abs=0.05)
    line_px = page.locator("#overlay .distance").evaluate("line => getComputedStyle(line).vectorEffect")
    assert line_px == "non-scaling-stroke"
    page.locator("body").press("l")
    assert page.locator(".lens:visible").count() == 2
    # The edge crosses each magnifier: one side of it is a finger.
    sides = page.locator("#lens_left").evaluate(
        "lens => { const row = lens.getContext('2d').getImageData(0, 160, 320, 1).data; return [row[40], row[1240]]; }"
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
    assert "1 turning points, 1 stretches without a value" in page.get_attribute("#scrub", "aria-label")

    # From a tenth to eight times the speed.
    speeds = [float(each.rstrip(TIMES)) for each in page.locator("#speed option").all_inner_texts()]
    assert {0.1, 1.0, 8.0} <= set(speeds)
    page.select_option("#speed", "8")
    page.click("#play")
    is_at(page, FRAMES - 1)
    assert page.locator("#frame").bounding_box() == frame


@pytest.fixture
def modelled(frames: Path, tmp_path: Path) -> Iterator[str]:
    """Address of the page of the recording, with the log of a stage and a model that is wrong at one end."""
    inputs = tmp_path / "drive.csv"
    rows = [f"{number / RATE_HZ:.4f},{gap_px(number) / PX_PER_MM:.6f}" for number in range(FRAMES)]
    inputs.write_text("\n".join(["time_s,input_mm", *rows]) + "\n")
    model = tmp_path / "model.csv"
    model.write_text("input_mm,gap_mm\n0,0\n3,3\n3.6,5.6\n")
    log = ("--drive", str(inputs), "--drive-offset-s", "0")
    scale = stated_scale(PX_PER_MM, 0.05)
    view = Playback(recorded(str(frames), RATE_HZ, Choices(scale=scale), log), tmp_path / "out")
    comparison = Comparison(view, model)
    view.features["model"] = comparison
    view.on_table = comparison.add_all
    with serving(view) as page:
        view.start()
        yield page.address
        view.stop()


def test_a_change_is_as_unsure_as_what_grows_with_the_gap(served: str, opened: Callable[..., Any]) -> None:
    page = opened(served)
    gap_mm = np.linspace(4.0, 16.0, 101)
    random_mm, fixed_mm, relative = 0.001, 0.01, 0.003
    u_mm = np.sqrt(random_mm**2 + fixed_mm**2 + (relative * gap_mm) ** 2)
    nothing = [None] * gap_mm.size
    columns = {
        "time": (gap_mm / 3.0).tolist(), "value": gap_mm.tolist(), "low": (gap_mm - 2 * u_mm).tolist(),
        "high": (gap_mm + 2 * u_mm).tolist(), "model": nothing, "frame": list(range(gap_mm.size)),
        "status": nothing, "random": [random_mm] * gap_mm.size, "u_difference": nothing,
    }  # fmt: skip
    said = page.evaluate("async given => (await import('/page/range_statistics.js')).statistics(given, 0, 9)", columns)
    assert said["U_change"] == pytest.approx(2.0 * np.hypot(np.sqrt(2.0) * random_mm, relative * 12.0), rel=1e-3)
    assert said["U_slope"] == pytest.approx(2.0 * relative * 3.0, rel=1e-2)


def dragged(page: Any, chart: str, shares: tuple[float, float], *, shift: bool = False) -> None:
    """Drag over a part of a chart."""
    box = page.locator(f"{chart} .u-over").bounding_box()
    if shift:
        page.keyboard.down("Shift")
    page.mouse.move(box["x"] + shares[0] * box["width"], box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + shares[1] * box["width"], box["y"] + box["height"] / 2, steps=4)
    page.mouse.up()
    if shift:
        page.keyboard.up("Shift")


def test_a_model_without_a_known_input_says_what_is_missing_in_place_of_an_empty_panel(
    frames: Path, tmp_path: Path, opened: Callable[..., Any]
) -> None:
    view = Playback(recorded(str(frames), RATE_HZ, Choices(scale=BareScale(PX_PER_MM)), ()), tmp_path / "out")
    model = tmp_path / "model.csv"
    model.write_text("input_mm,gap_mm\n0,1\n3,4\n")
    view.features["model"] = Comparison(view, model)
    with serving(view) as served:
        view.start()
        page = opened(served.address, viewport={"width": 1280, "height": 720})
        shown(page, WHOLE)
        page.locator("#model_words", has_text="log of the drive").wait_for()
        for part in ("#residual_chart", "#worst"):
            assert not page.locator(part).is_visible()
        view.stop()


def saved(page: Any, button: str) -> bytes:
    return downloaded(page, lambda: page.click(button)).read_bytes()


def charts(page: Any) -> list[dict[str, float]]:
    """Where the gap and the residual are drawn."""
    return [page.locator(f"{each} .u-over").bounding_box() for each in ("#chart", "#residual_chart")]


def assert_times_stand_under_each_other(page: Any) -> None:
    gap, residual = charts(page)
    assert (residual["x"], residual["width"]) == pytest.approx((gap["x"], gap["width"]), abs=0.5)


def test_graph_measures_a_range_shows_the_residual_and_exports_what_is_seen(
    modelled: str, opened: Callable[..., Any]
) -> None:
    page = opened(modelled, viewport={"width": 1280, "height": 720})
    shown(page, WHOLE)
    page.locator("#residual_chart .u-over").wait_for()
    shown(page, "document.querySelector('#model_residual').textContent.includes('RMS')")
    gap, residual = charts(page)
    assert residual["y"] >= gap["y"] + gap["height"]
    assert residual["height"] > 30
    assert_times_stand_under_each_other(page)

    # The model is wrong where the gap is widest, and a key leads to that frame.
    page.locator("body").press("w")
    is_at(page, WIDEST)
    words = page.inner_text("#readout")
    assert float(re.search(r"residual (-?[\d.]+)", words)[1]) == pytest.approx(
        -1e4 / 3 * (gap_px(WIDEST) / 34 - 3), abs=5
    )
    # A click on a point of either chart shows its frame.
    box = page.locator("#residual_chart .u-over").bounding_box()
    page.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    is_at(page, round(0.25 * (FRAMES - 1)))

    # A range: its mean and slope are those of the stroke, within what is stated.
    dragged(page, "#chart", (0.1, 0.4))
    words = page.inner_text("#range_words")
    first, last = map(int, re.search(r"frames (\d+) to (\d+)", words).groups())
    truth = [gap_px(number) / PX_PER_MM for number in range(first, last + 1)]
    mean, u_mean = map(float, re.search(r"mean (\S+) ± (\S+) mm", words).groups())
    slope, u_slope = map(float, re.search(r"slope (\S+) ± (\S+) mm/s", words).groups())
    assert f"n = {len(truth)}" in words
    assert "± at k = 2" in words
    assert mean == pytest.approx(np.mean(truth), abs=2 * u_mean)
    assert slope == pytest.approx(3.0 / PX_PER_MM * RATE_HZ, abs=2 * u_slope)
    # The mean of many frames is no surer than what all of them share, and no less sure than one of them.
    single_mm = float(re.search(r"± ([\d.]+)", page.inner_text("#uncertainty"))[1]) / 1e3
    assert 2.0 * 0.05 / PX_PER_MM * mean < u_mean <= single_mm + 5e-4
    assert 0.0 < u_slope < 0.02
    page.click("#range_mark")
    shown(page, f"document.querySelector('#range').textContent === 'marked {first} to {last}'")

    # What is seen is what is saved: rows, lines and pixels.
    page.click("#range_zoom")
    dragged(page, "#residual_chart", (0.2, 0.8), shift=True)
    rows = list(csv.DictReader(io.StringIO(saved(page, "#save_seen").decode())))
    numbers = [int(row["frame"]) for row in rows]
    assert numbers == list(range(numbers[0], numbers[-1] + 1))
    assert first < numbers[0] < numbers[-1] < last
    for row in rows:
        residual_mm = float(row["gap_mm"]) - float(row["model_mm"])
        assert float(row["residual_mm"]) == pytest.approx(residual_mm, abs=2e-7)
    drawing = ET.fromstring(saved(page, "#save_svg"))
    names = {each.get("id") for each in drawing.iter("{http://www.w3.org/2000/svg}g")}
    assert {"gap", "residual"} <= names
    line = drawing.find(".//{*}g[@id='gap']/{*}polyline")
    assert len(line.get("points").split()) == len(rows)
    picture = cv2.imdecode(np.frombuffer(saved(page, "#save_plot"), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape[1] == 2 * int(drawing.get("width"))
    assert picture.std() > 1.0
    page.locator("body").press("Escape")
    assert page.locator("#range_bar").is_hidden()


def test_numbers_are_taken_as_people_type_them_and_what_is_refused_goes_with_its_message(
    served: str, opened: Callable[..., Any]
) -> None:
    page = opened(served, viewport={"width": 1280, "height": 720})
    shown(page, WHOLE)
    for field, words, state in (
        ("#below_tip", "400 µm", "0.4"),
        ("#below_tip", "0,3 mm", "0.3"),
        ("#px_per_mm", "34,5", "34.5"),
        ("#px_per_mm", "34,0 px/mm", "34"),
    ):
        typed(page, field, words)
        shown(page, f"document.querySelector('{field}').value === '{state}'")
    page.fill("#greatest", "5,5 mm")
    typed(page, "#least", "0,5")
    shown(
        page, "document.querySelector('#least').value === '0.5' && document.querySelector('#greatest').value === '5.5'"
    )

    # What is refused stays to be mended, says why in words of the page, and goes with its message.
    for field, words, why, state in (
        ("#px_per_mm", "", "The scale must be a number, but is empty.", "34"),
        ("#px_per_mm", "1,234", "write 1.234 or 1234", "34"),
        ("#px_per_mm", "34 mm", "The scale must be in px/mm, but is in 'mm'.", "34"),
        ("#below_tip", "-1", "The height below the tips must be positive", "0.3"),
        ("#region_w", "1", "The region must be at least 8 pixels wide and high, but is 1x240 pixels.", "320"),
    ):
        typed(page, field, words)
        page.locator("#panels .refused", has_text=why).wait_for()
        assert "--" not in page.inner_text("#panels")
        assert page.input_value(field) == words
        page.press(field, "Escape")
        assert page.input_value(field) == state
        assert page.locator("#panels .refused", has_text=why).count() == 0
    # A scale that doubles all gaps is asked about.
    typed(page, "#px_per_mm", "12")
    page.locator("button.sure").wait_for()
    assert page.inner_text("#scale").startswith("34.0000")
    page.click("button.sure")
    shown(page, "document.querySelector('#scale').textContent.startsWith('12.0000')")

    # A region of one pixel is refused in the picture, where it is drawn, and can be drawn again at once.
    page.click("#drag_region")
    drag(page, (100, 100, 1, 1))
    assert "at least 8 each way" in page.inner_text("#hint")
    drag(page, (10, 10, 300, 220))
    shown(page, "document.querySelector('#region_w').value === '300'")


BARS_MM, BAR_PX_PER_MM, BAR_LEFT_PX = (2.0, 3.0, 4.0), 34.0, 80


@pytest.fixture
def of_bars(tmp_path: Path) -> Iterator[str]:
    """Address of the page of a recording that shows a bar of another width in each frame, and has no scale."""
    folder = tmp_path / "bars"
    folder.mkdir()
    rng = np.random.default_rng(4)
    for number, size_mm in enumerate(BARS_MM):
        picture = np.full((240, 320), 200.0)
        picture[:, BAR_LEFT_PX : BAR_LEFT_PX + round(size_mm * BAR_PX_PER_MM)] = 40.0
        picture = cv2.GaussianBlur(picture, (0, 0), 1.2) + rng.normal(0.0, 1.0, picture.shape)
        cv2.imwrite(str(folder / f"{number}.png"), np.round(picture).astype(np.uint8))
    view = Playback(recorded(str(folder), RATE_HZ, Choices(), ()), tmp_path / "out")
    with serving(view) as page:
        view.start()
        yield page.address
        view.stop()


def test_a_scale_is_found_by_dragging_over_references_in_several_frames(
    of_bars: str, opened: Callable[..., Any], tmp_path: Path
) -> None:
    page = opened(of_bars, viewport={"width": 1280, "height": 720})
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 0")
    for number, size_mm in enumerate(BARS_MM):
        before = int(page.get_attribute("#picture", "data-shown")) if number else 0
        typed(page, "#go_frame", str(number))
        shown(page, f"Number(document.querySelector('#picture').dataset.shown) > {before}")
        page.click("#drag_reference")
        drag(page, (BAR_LEFT_PX - 40, 60, round(size_mm * BAR_PX_PER_MM) + 80, 100))
        page.fill("#size_mm", f"{size_mm:g} mm")
        if number < len(BARS_MM) - 1:
            page.click("#more_references")
            page.locator("#references", has_text=f"in frame {number}").wait_for()
    page.press("#size_mm", "Enter")
    says(page, "Calibrated: ")
    (path,) = (tmp_path / "out").glob("calibration_*.json")
    found = read_calibration(path)
    assert found.px_per_mm == pytest.approx(BAR_PX_PER_MM, abs=2.0 * found.covariance[0, 0] ** 0.5)
    assert len(found.references) == len(BARS_MM)
    # Three sizes determine the edge bias, so that no limit of it remains in the budget.
    assert "edge bias" not in {part.source for part in found.parts}
    assert page.locator("#references_bar").is_hidden()
