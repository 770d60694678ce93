"""Gauges drawn on a recording: valid gauges are stored, invalid ones refused, and readings equal those of `measure`."""

import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.errors import DataError, FingervisionError, StateError
from fingervision.gauges.gauge_file import read_gauges
from fingervision.gauges.kinds import kind_named, kinds
from fingervision.live.choices import Choices
from fingervision.live.commands import obey, section
from fingervision.live.commands.gauges import settings_of
from fingervision.live.playback.gauge_board import ChangedMeanwhileError, FieldError
from fingervision.live.playback.gauge_following import GaugesBeside, put_gauges_beside
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.recorded import recorded
from fingervision.storage.gauge_files import gauges_text
from tests.csv_rows import csv_rows
from tests.gauges.drawn import bar, drawn, half_plane, seen
from tests.live.browser import browser, downloaded, keep, opened, says, shown, typed
from tests.live.test_page_layout import findings
from tests.waiting import until

__all__ = ["browser", "opened"]

SHAPE, FRAMES = (192, 256), 12
EDGE = {"name": "the edge", "kind": "edge", "x_px": 80, "y_px": 96.5, "direction_deg": 0, "length_px": 60}
BAR = {
    "name": 'a "bar" ü',
    "kind": "pair",
    "x_px": 180,
    "y_px": 96,
    "direction_deg": 0.0,
    "distance_px": 30,
    "length_px": 50,
    "reach_px": 6,
    "polarity": "dark",
}


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A moving edge, and a bar at rest."""
    folder = tmp_path_factory.mktemp("edge") / "frames"
    folder.mkdir()
    rng = np.random.default_rng(5)
    for number in range(FRAMES):
        # All rows are alike.
        light = drawn((1, SHAPE[1]), 60, [(half_plane(80 + 2.5 * number, 0, 0.0), 160), (bar(180, 0, 0.0, 30), 60)])
        cv2.imwrite(str(folder / f"{number:03d}.png"), seen(light.repeat(SHAPE[0], axis=0), 1.0, rng))
    return folder


@pytest.fixture
def opened_on(frames: Path, tmp_path: Path) -> Iterator[Callable[..., tuple[Playback, GaugesBeside]]]:
    """Recordings with a gauge board, which are closed after the test."""
    views: list[Playback] = []

    def open_on(path: Path, px_per_mm: float | None = None) -> tuple[Playback, GaugesBeside]:
        scale = None if px_per_mm is None else BareScale(px_per_mm)
        view = Playback(recorded(str(frames), 25.0, Choices(scale=scale), ()), tmp_path / "out")
        beside = put_gauges_beside(view, path)
        view.start()
        views.append(view)
        return view, beside

    yield open_on
    for view in views:
        view.stop()


Opened = Callable[..., tuple[Playback, GaugesBeside]]


@pytest.mark.parametrize("name", kinds())
def test_a_kind_says_all_its_keys_and_a_gauge_of_usual_values_can_be_meant(name: str, opened_on: Opened) -> None:
    fields = [SimpleNamespace(**each) for each in settings_of(kind_named(name).SPEC)]
    for field in fields:
        assert field.choices or (field.low is not None and field.high is not None)
        assert field.default is None or not field.choices or field.default in field.choices
    view, _ = opened_on(Path("does_not_exist.toml"))
    table = {field.key: field.usual for field in fields if field.default is None}
    obey(view, {"do": "gauge_add", "table": {**table, "name": name, "kind": name}})
    assert [table["name"] for table in section(view)["gauges"]["tables"]] == [name]


def test_what_is_added_and_changed_is_saved_and_read_again_the_same(opened_on: Opened, tmp_path: Path) -> None:
    path = tmp_path / "new" / "gauges.toml"
    view, beside = opened_on(path)
    with pytest.raises(DataError, match="at least one"):
        obey(view, {"do": "gauges_save"})
    obey(view, {"do": "gauge_add", "table": EDGE})
    obey(view, {"do": "gauge_add", "table": BAR})
    obey(view, {"do": "gauge_change", "name": "the edge", "changes": {"name": "lever", "x_px": 81.25}})
    assert not section(view)["gauges"]["is_saved"]
    assert not path.exists()
    obey(view, {"do": "gauges_save"})
    assert section(view)["gauges"]["is_saved"]
    meant = [{**EDGE, "name": "lever", "x_px": 81.25}, BAR]
    assert tomllib.loads(path.read_text(encoding="utf-8")) == {"schema": 1, "gauge": meant}
    assert read_gauges(path) == beside.board.gauges
    again, other = opened_on(path)
    assert section(again)["gauges"]["tables"] == meant
    assert other.board.gauges == beside.board.gauges
    obey(view, {"do": "gauge_remove", "name": "lever"})
    obey(view, {"do": "gauges_load"})
    assert section(view)["gauges"]["tables"] == meant
    assert [each.name for each in path.parent.iterdir()] == ["gauges.toml"]


def test_comments_and_numbers_of_the_file_stay(opened_on: Opened, tmp_path: Path) -> None:
    path = tmp_path / "gauges.toml"
    before = (
        "# of the bench\nschema = 1   # for ever\n\n[[gauge]]   # the first\nname = 'one'\nkind = \"edge\"\n"
        "x_px = 8e1    # measured by hand\ny_px = 96\ndirection_deg = 0\nlength_px = 40\n\n# below the second\n"
        "[[gauge]]\nname = 'two'\nkind = \"edge\"\nx_px = 80\ny_px = 90  # here\ndirection_deg = 0\nlength_px = 40\n"
    )
    path.write_text(before)
    view, _ = opened_on(path)
    obey(view, {"do": "gauges_save"})
    assert path.read_text() == before
    obey(view, {"do": "gauge_change", "name": "two", "changes": {"name": "zwei", "y_px": 91}})
    obey(view, {"do": "gauge_add", "table": BAR})
    obey(view, {"do": "gauges_save"})
    text = path.read_text(encoding="utf-8")
    for words in ("# of the bench", "# for ever", "# the first", "8e1    # measured by hand", "# below the second"):
        assert words in text
    assert "y_px = 91  # here" in text
    obey(view, {"do": "gauge_remove", "name": "one"})
    obey(view, {"do": "gauges_save"})
    assert [table["name"] for table in tomllib.loads(path.read_text(encoding="utf-8"))["gauge"]] == [
        "zwei",
        BAR["name"],
    ]
    assert "# here" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"x_px": "eighty"}, "x_px"),
        ({"x_px": -20}, "x_px"),
        ({"y_px": 5000}, "y_px"),
        ({"x_px": float("nan")}, None),
        ({"length_px": 2}, "length_px"),
        ({"length_px": 10**30}, None),
        ({"length_px": 15000}, None),
        ({"reach_px": 0}, "reach_px"),
        ({"polarity": "up"}, "polarity"),
        ({"colour": "red"}, "colour"),
        ({"kind": "egde"}, "kind"),
        ({"name": ""}, "name"),
        ({"name": "two\nlines"}, "name"),
        ({"name": BAR["name"]}, "name"),
        ({"direction_deg": True}, None),
        ({"length_px": None}, None),
        ({"direction_deg": [1]}, None),
    ],
)
def test_a_wrong_value_is_a_sentence_at_its_key_and_changes_nothing(
    changes: dict[str, Any], key: str | None, opened_on: Opened, tmp_path: Path
) -> None:
    view, _ = opened_on(tmp_path / "gauges.toml")
    for table in (EDGE, BAR):
        obey(view, {"do": "gauge_add", "table": table})
    before = section(view)["gauges"]
    for request in (
        {"do": "gauge_change", "name": "the edge", "changes": changes},
        {"do": "gauge_add", "table": {**EDGE, "name": "other", **changes}},
    ):
        with pytest.raises(FingervisionError) as refused:
            obey(view, request)
        if key is not None:
            assert isinstance(refused.value, FieldError)
            assert refused.value.field == key
        assert "must" in str(refused.value) or "not known" in str(refused.value)
        assert "\n" not in str(refused.value)
    now = section(view)["gauges"]
    assert (now["tables"], now["version"]) == (before["tables"], before["version"])


def test_a_key_that_is_missing_is_said(opened_on: Opened, tmp_path: Path) -> None:
    view, _ = opened_on(tmp_path / "gauges.toml")
    for bad in ({}, {"name": "a"}, {"name": "a", "kind": "edge"}, None, [], "edge", {str(i): 1 for i in range(99)}):
        with pytest.raises(FingervisionError):
            obey(view, {"do": "gauge_add", "table": bad})
    for request in ("gauge_remove", "gauge_change"):
        with pytest.raises(StateError, match="no gauge"):
            obey(view, {"do": request, "name": "nobody", "changes": {"x_px": 1}})
    assert section(view)["gauges"]["tables"] == []


def test_a_file_that_somebody_else_changed_is_not_overwritten(opened_on: Opened, tmp_path: Path) -> None:
    path = tmp_path / "gauges.toml"
    view, _ = opened_on(path)
    obey(view, {"do": "gauge_add", "table": EDGE})
    path.write_text("# theirs\nschema = 1\n")
    for _ in range(2):
        with pytest.raises(ChangedMeanwhileError, match="another program"):
            obey(view, {"do": "gauges_save"})
        assert path.read_text() == "# theirs\nschema = 1\n"
    assert section(view)["gauges"]["changed_meanwhile"]
    with pytest.raises(DataError):
        obey(view, {"do": "gauges_load"})
    assert section(view)["gauges"]["tables"] == [EDGE]
    obey(view, {"do": "gauges_save", "over": True})
    assert tomllib.loads(path.read_text())["gauge"] == [EDGE]
    assert not section(view)["gauges"]["changed_meanwhile"]
    path.unlink()
    with pytest.raises(ChangedMeanwhileError, match="another program"):
        obey(view, {"do": "gauges_save"})


def test_a_file_that_cannot_be_written_is_said_and_nothing_lost(opened_on: Opened, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    view, _ = opened_on(tmp_path / "folder" / "gauges.toml")
    obey(view, {"do": "gauge_add", "table": EDGE})
    (tmp_path / "folder").write_text("a file where the folder should be")
    with pytest.raises(ChangedMeanwhileError, match="could not be"):
        obey(view, {"do": "gauges_save"})
    assert section(view)["gauges"]["tables"] == [EDGE]


@pytest.mark.parametrize("text", ["schema = 1\n", "not toml", 'schema = 1\n[[gauge]]\nname = "a"\nkind = "edge"\n'])
def test_a_file_that_cannot_be_meant_is_refused_before_anything(text: str, opened_on: Opened, tmp_path: Path) -> None:
    path = tmp_path / "gauges.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=r"gauges\.toml"):
        opened_on(path)
    assert path.read_text() == text


@pytest.mark.slow
def test_readings_are_those_of_measure(opened_on: Opened, frames: Path, tmp_path: Path) -> None:
    path, out = tmp_path / "gauges.toml", tmp_path / "measured"
    view, beside = opened_on(path, 20.0)
    obey(view, {"do": "gauge_add", "table": EDGE})
    obey(view, {"do": "gauge_add", "table": BAR})
    with pytest.raises(FingervisionError, match="not saved"):
        obey(view, {"do": "measure"})
    obey(view, {"do": "gauges_save"})
    options = ["--px-per-mm", "20", "--rate-hz", "25", "--gauges", str(path), "--out", str(out)]
    subprocess.run([sys.executable, "-m", "fingervision", "measure", str(frames), *options], check=True)
    rows = [list(row.values())[1:] for row in csv_rows(out / "gauges.csv")]
    obey(view, {"do": "seek", "frame": FRAMES - 1})
    until(lambda: beside.following.frames >= FRAMES, lambda: beside.following.trouble)
    found = []
    for frame in range(FRAMES):
        readings = beside.following.readings(frame, beside.board.version)
        assert readings is not None
        found += [[each["name"], *cell, each["status"]] for each in readings for cell in each["cells"]]
    assert len(found) == len(rows) == 2 * FRAMES
    for ours, theirs in zip(found, rows, strict=True):
        assert [ours[0], ours[1], ours[4], ours[-1]] == [theirs[0], theirs[1], theirs[4], theirs[5]]
        assert [*ours[2:4], ours[5]] == pytest.approx([float(theirs[k]) for k in (2, 3, 6)], abs=1e-6)
    # After any change nothing of before is shown.
    obey(view, {"do": "gauge_remove", "name": "the edge"})
    assert beside.following.readings(0, beside.board.version) is None
    assert json.dumps(section(view))


def mouse(page: Any, way: list[tuple[float, float]]) -> None:
    """Drag the mouse along points of the picture, in the picture's pixels."""
    box = page.locator("#picture").bounding_box()
    places = [
        (box["x"] + (x + 0.5) / SHAPE[1] * box["width"], box["y"] + (y + 0.5) / SHAPE[0] * box["height"])
        for x, y in way
    ]
    page.mouse.move(*places[0])
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*place, steps=4)
    page.mouse.up()


def reads(page: Any, name: str, words: str) -> str:
    line = page.locator("#gauge_list li", has=page.locator(f"button:text-is('{name}')")).locator("span", has_text=words)
    line.wait_for()
    return str(line.inner_text())


@pytest.mark.slow
def test_gauges_are_drawn_dragged_typed_and_saved_in_the_page(
    live: Callable[..., Any], opened: Callable[..., Any], frames: Path, tmp_path: Path
) -> None:
    path = tmp_path / "gauges.toml"
    view = live(frames, "--rate-hz", "25", "--px-per-mm", "20", "--port", "0", "--no-browser", name="gauge")
    page = opened(view.address, viewport={"width": 1280, "height": 720})
    shown(page, "document.querySelector('#gauge_kind').options.length > 5")
    assert page.locator("#gauges").get_attribute("open") is not None

    # The table is whole; nothing asks for fingers, and nothing is said of them.
    shown(page, "document.querySelector('#place').textContent === 'frame 0 of 12'")
    assert not page.locator("#gap_mm").is_visible()
    assert not page.locator("#status").is_visible()

    # Drawn with the mouse: across an edge; then dragged by its middle.
    page.select_option("#gauge_kind", "edge")
    page.fill("#gauge_new_name", "lever")
    page.click("#gauge_draw")
    mouse(page, [(70, 96), (96, 96)])
    reads(page, "lever", "ok")
    assert float(page.input_value("#gauge_key_x_px")) == pytest.approx(83, abs=1)
    assert float(page.input_value("#gauge_key_direction_deg")) == pytest.approx(0, abs=3)
    mouse(page, [(float(page.input_value("#gauge_key_x_px")), 96), (80, 100), (79, 120)])
    shown(page, "document.querySelector('#gauge_key_y_px').value > 118")
    assert float(page.input_value("#gauge_key_x_px")) == pytest.approx(79, abs=1)
    # Typed, and moved by arrow keys.
    typed(page, "#gauge_key_direction_deg", "0")
    typed(page, "#gauge_key_y_px", "96")
    page.locator("#gauge_list button").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowUp")
    shown(page, "document.querySelector('#gauge_key_y_px').value === '86'")
    words = reads(page, "lever", "ok")
    assert float(words.split()[1]) == pytest.approx((80 - 127.5) / 20, abs=0.002), words

    # By the keyboard alone: added, refused beside the field with what was typed in it, mended.
    page.select_option("#gauge_kind", "pair")
    page.locator("#gauge_new_name").press("Enter")
    shown(page, "document.querySelector('#gauge_key_name').value === 'pair'")
    for key, value in (("distance_px", "1"), ("x_px", "180")):
        typed(page, f"#gauge_key_{key}", value)
    page.locator("#gauge_key_distance_px_why", has_text="must be between 3 and").wait_for()
    assert page.input_value("#gauge_key_distance_px") == "1"
    typed(page, "#gauge_key_distance_px", "30")
    shown(page, "document.querySelector('#gauge_key_distance_px_why').textContent === ''")
    typed(page, "#gauge_key_name", "the bar")
    words = reads(page, "the bar", "ok")
    assert float(words.split()[1]) == pytest.approx(1.5, abs=0.005), words
    assert findings(page) == []

    # Saved; the file measures; what is shown of a later frame is the table's row.
    page.click("#gauge_save")
    says(page, "2 gauges saved")
    command = ["measure", str(frames), "--rate-hz", "25", "--px-per-mm", "20", "--gauges", str(path)]
    subprocess.run([sys.executable, "-m", "fingervision", *command, "--out", str(tmp_path / "measured")], check=True)
    rows = [row for row in csv_rows(tmp_path / "measured" / "gauges.csv") if row["gauge"] == "lever"]
    page.locator("#scrub").fill("7")
    words = reads(page, "lever", f"position {float(rows[7]['value']):.4f} mm")
    assert "ok" in words
    assert page.locator("#gauge_drawing .mark.found").count() > 0

    # Somebody else's file is not written over unless that is asked for.
    theirs = path.read_text() + "# theirs\n"
    path.write_text(theirs)
    page.click("#gauge_remove")
    shown(page, "document.querySelector('#gauge_saved').textContent === 'not saved'")
    page.click("#gauge_save")
    page.locator("#gauge_words", has_text="another program").wait_for()
    assert path.read_text() == theirs
    page.click("#gauge_over")
    says(page, "1 gauges saved")
    assert [each["name"] for each in tomllib.loads(path.read_text())["gauge"]] == ["lever"]

    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert findings(page) == []
    # Who only looks sees the gauges, and changes nothing.
    viewer = opened(view.until(lambda live: [w for w in live.text().split() if "token=" in w][1:])[0])
    viewer.locator("#gauge_list li .good").first.wait_for()
    assert viewer.locator("#gauge_save").is_disabled()
    assert viewer.locator("#gauge_key_x_px").is_disabled()
    assert view.stop() == 0


@pytest.mark.slow
def test_the_panel_is_in_the_live_page_of_a_recording_and_costs_nothing_until_it_is_opened(
    live: Callable[..., Any], opened: Callable[..., Any], frames: Path
) -> None:
    view = live(frames, "--rate-hz", "25", "--port", "0")
    page = opened(view.address, viewport={"width": 1280, "height": 720})
    page.locator("#gauges").wait_for()
    assert page.locator("#gauges").get_attribute("open") is None
    page.locator("#gauges summary").click()
    page.locator("#gauge_hint", has_text="scale is not known").wait_for()
    page.locator("#gauge_new_name").press("Enter")
    page.locator("#gauge_list button").wait_for()
    typed(page, "#px_per_mm", "20")
    page.locator("#gauge_list .bad, #gauge_list .good").wait_for()


def charts(page: Any) -> dict[str, str]:
    """Heads of the gauges' charts: what each shows, and its value in the frame that is shown."""
    heads = [line.split(" (") for line in page.locator("#gauge_charts figcaption").all_inner_texts()]
    return {name: value.partition(") ")[2] for name, value in heads}


def series(page: Any) -> list[list[Any]]:
    """Values of all series of the page's gauges: name, quantity, unit, and time, value, lower end and status."""
    return page.evaluate(  # type: ignore[no-any-return]
        "import('/page/series_data.js').then(m => m.gaugeSeries().map(s => "
        "[s.gauge, s.quantity, s.unit, s.time, s.value, s.low, s.status]))"
    )


def test_each_gauge_has_a_chart_and_all_that_is_saved_has_the_gauges(
    live: Callable[..., Any], opened: Callable[..., Any], frames: Path, tmp_path: Path
) -> None:
    # The bar's gauge reaches less far than its bar is away: it has no value in any frame.
    line = {**EDGE, "name": "lean", "kind": "line", "angle_deg": 90.0, "x_px": 80}
    del line["direction_deg"]
    lost = {**BAR, "name": "lost", "x_px": 225, "distance_px": 12}
    path = tmp_path / "gauges.toml"
    path.write_text(gauges_text([(table, None) for table in (EDGE, line, lost)], None, 1), encoding="utf-8")
    options = ["--rate-hz", "25", "--px-per-mm", "20", "--gauges", str(path)]
    command = [sys.executable, "-m", "fingervision", "measure", str(frames), *options]
    subprocess.run([*command, "--out", str(tmp_path / "measured")], check=True)
    table = (tmp_path / "measured" / "gauges.csv").read_text(encoding="utf-8")

    view = live(frames, *options, "--port", "0", "--no-page", name="gauge")
    page = opened(view.address, viewport={"width": 1280, "height": 800})
    shown(page, "document.querySelectorAll('#gauge_charts figure').length === 4")
    page.locator("#scrub").fill("7")
    page.locator("#gauge_list li", has_text="lean").locator(".good").wait_for()
    until(lambda: page.evaluate("import('/page/bus.js').then(m => m.page.state.gauges.is_whole)"))
    until(lambda: len(series(page)[0][3]) == FRAMES)
    # One chart for each quantity, with the values of the table and their uncertainty, or why there is none.
    rows = csv_rows(tmp_path / "measured" / "gauges.csv")
    for name, quantity, unit, times, values, low, statuses in series(page):
        own = [row for row in rows if (row["gauge"], row["quantity"]) == (name, quantity)]
        assert times == pytest.approx([float(row["time_s"]) for row in own])
        assert [status or "ok" for status in statuses] == [row["status"] for row in own]
        assert {unit} == {row["unit"] for row in own}
        if name == "lost":
            assert values == [None] * FRAMES
            continue
        assert values == pytest.approx([float(row["value"]) for row in own], abs=1e-6)
        expanded = [value - least for value, least in zip(values, low, strict=True)]
        assert expanded == pytest.approx([2 * float(row["u"]) for row in own], abs=1e-6)
    heads = charts(page)
    assert list(heads) == ["the edge: position", "lean: position", "lean: angle", "lost: distance"]
    seen = {row["gauge"]: row for row in rows if float(row["time_s"]) == pytest.approx(7 / 25)}
    assert heads["lost: distance"] == seen["lost"]["status"].replace("_", " ")
    assert float(heads["the edge: position"].split(" ±")[0]) == pytest.approx(
        float(seen["the edge"]["value"]), abs=1e-5
    )
    words = page.inner_text("body")
    assert "finger " not in words.replace("fingervision", "")
    assert "one_finger" not in words
    assert str(tempfile.gettempdir()) not in words.replace(str(tmp_path), "")
    # The chart that is pointed at is read out, and measured.
    box = page.locator("#gauge_charts .u-over").nth(2).bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.5 * box["height"])
    page.locator("#readout", has_text="lean: angle").wait_for()
    page.mouse.down()
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 0.5 * box["height"], steps=4)
    page.mouse.up()
    page.locator("#range_words", has_text="mrad/s").wait_for()
    page.keyboard.press("Escape")

    # Saved: the table of `measure`, what is seen of it, and the page with all of it.
    saved = downloaded(page, lambda: page.click("#save_csv"))
    assert saved.read_text(encoding="utf-8") == table
    seen_rows = csv_rows(downloaded(page, lambda: page.click("#save_seen")))
    assert len(seen_rows) == len(rows)
    assert "lean: angle (mrad)" in downloaded(page, lambda: page.click("#save_svg")).read_text(encoding="utf-8")
    keep(page, "gauges_1280")
    document = tmp_path / "page.html"
    document.write_bytes(downloaded(page, lambda: page.click("#save_page")).read_bytes())
    kept = page.context.new_page()
    kept.goto(document.as_uri())
    shown(kept, "document.querySelectorAll('#gauge_charts figure').length === 4")
    kept.keyboard.press("End")
    shown(kept, f"document.querySelector('#gap_mm').dataset.frame === '{FRAMES - 1}'")
    last = next(row for row in reversed(rows) if row["gauge"] == "the edge")
    assert float(charts(kept)["the edge: position"].split(" ±")[0]) == pytest.approx(float(last["value"]), abs=1e-5)
    kept.locator("#gauge_list li", has_text="the edge").locator(".good").wait_for()
    assert kept.locator("#gauge_drawing .mark.found").count() > 0
    assert not kept.locator("#gauge_form").is_visible()
    assert not kept.locator("#alarm").is_visible()
    kept.close()

    # Names in the picture do not lie on each other, on a screen or on a phone.
    for width, height in ((1280, 800), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        page.keyboard.press("Home")
        shown(page, "document.querySelector('#gap_mm').dataset.frame === '0'")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert findings(page) == []
        boxes = page.evaluate(
            "[...document.querySelectorAll('#gauge_drawing text')].map(e => e.getBoundingClientRect())"
            ".map(r => [r.left, r.right, r.top, r.bottom])"
        )
        assert len(boxes) == 3
        for one, other in combinations(boxes, 2):
            apart = [min(one[k + 1], other[k + 1]) - max(one[k], other[k]) for k in (0, 2)]
            assert min(apart) <= 1.0, boxes
    keep(page, "gauges_390")
    assert view.stop() == 0


def test_where_a_gauge_asks_for_the_gap_it_is_shown_beside_the_gauges(
    live: Callable[..., Any], opened: Callable[..., Any], tmp_path: Path
) -> None:
    path, opening = tmp_path / "gauges.toml", Path(__file__).parents[2] / "sample_frames" / "opening"
    path.write_text((opening / "gauges.toml").read_text(encoding="utf-8"), encoding="utf-8")
    view = live(
        opening / "opening.mp4", "--px-per-mm", "34", "--gauges", path, "--port", "0", "--no-page", name="gauge"
    )
    page = opened(view.address, viewport={"width": 1280, "height": 800})
    shown(page, "Number(document.querySelector('#gap_mm').textContent) > 0")
    shown(page, "document.querySelectorAll('#gauge_charts figure').length === 4")
    assert page.locator("#chart .u-over").is_visible()
    # Without fingers there is no gap, and the gauges stay.
    page.locator("#set_up summary").click()
    page.select_option("#fingers", "none")
    page.locator("#chart").wait_for(state="hidden")
    shown(page, "document.querySelectorAll('#gauge_charts figure').length === 4")
    page.locator("#gauge_list .good").first.wait_for()
    assert view.stop() == 0
