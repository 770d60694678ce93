"""Wrong input, dropped files, and simultaneous requests: each gives a sentence, and no data or measurement is lost."""

import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

from calib.calibration import BareScale
from calib.measured_scale import Calibration
from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import NoGap
from fingervision.domain.status import Status
from fingervision.frames.source import Wish
from fingervision.live.choices import Choices
from fingervision.live.commands import obey
from fingervision.live.frame_measurement import Seen
from fingervision.live.opening import opened as opened_source
from fingervision.live.server import Page, bound
from fingervision.live.session import Session
from fingervision.storage.calibration_json import read_calibration
from fingervision.storage.settings_toml import read_settings
from tests.live.browser import browser, opened, says, shown, typed
from tests.live.test_attacks import reply, socket_of

__all__ = ["browser", "opened"]
WRONG: list[dict[str, Any]] = [
    {"do": "region", "box": [0, 0, 0, 0]},
    {"do": "region", "box": [-1, 0, 10, 10]},
    {"do": "region", "box": [0, 0, 10_000, 10]},
    {"do": "region", "box": [0.5, 0, 10, 10]},
    {"do": "region", "box": "0,0,10,10"},
    {"do": "region", "box": [0, 0, 10**30, 10]},
    {"do": "height", "below_tip_mm": 0},
    {"do": "height", "below_tip_mm": -0.3},
    {"do": "height", "below_tip_mm": None},
    {"do": "height", "below_tip_mm": "1,234"},
    {"do": "height", "below_tip_mm": float("nan")},
    {"do": "tips", "tips": "upwards"},
    {"do": "fingers", "fingers": "grey"},
    {"do": "limits", "least": 2.0, "greatest": 1.0},
    {"do": "limits", "least": "one", "greatest": None},
    {"do": "scale", "px_per_mm": 0},
    {"do": "scale", "px_per_mm": -34},
    {"do": "scale", "px_per_mm": True},
    {"do": "scale", "px_per_mm": float("inf")},
    {"do": "scale", "px_per_mm": 34.0, "u_px_per_mm": 0},
    {"do": "scale", "px_per_mm": 34.0, "u_px_per_mm": 34.0},
    {"do": "scale", "px_per_mm": 34.0, "u_px_per_mm": "0,1 px"},
    {"do": "calibrate", "kind": "ring", "box": [0, 0, 10, 10], "size_mm": 1.0, "u_size_mm": 0.001},
    {"do": "calibrate", "kind": "bar", "box": [0, 0, 3, 3], "size_mm": 1.0, "u_size_mm": 0.001},
    {"do": "calibrate", "kind": "bar", "box": [0, 0, 640, 480], "size_mm": 0.0, "u_size_mm": 0.001},
    {"do": "calibrate", "kind": "bar", "box": [0, 0, 640, 480], "size_mm": 1.0, "u_size_mm": -1.0},
    {"do": "load_settings", "path": "/etc/passwd"},
    {"do": "load_settings", "path": "../../nothing.toml"},
    {"do": "load_settings", "path": ""},
    {"do": "load_settings", "path": "a" * 2000},
    {"do": "load_settings", "path": "a\0b"},
    {"do": "input", "input_mm": "far"},
    {"do": "bed_move", "to_mm": 1.0, "speed_mm_s": 1.0},
    {"do": "record", "on": True, "path": "<script>"},
    {"do": "nothing of the kind"},
    {"do": ["zero"]},
    {},
]


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    found = Session(opened_source("simulated", Wish()), Choices(scale=BareScale(34.0)), tmp_path / "out")
    pixels = np.full((480, 640), 200, np.uint8)
    pixels[60:420, 250:350] = 40
    found.seen = Seen(Frame(pixels, 0, 0.0, Coding.LOSSLESS), NoGap(Status.NO_FINGERS, ""), None)
    yield found
    found.capture.stop()


@pytest.mark.parametrize("request_", WRONG[:-6], ids=lambda each: json.dumps(each)[:60])
def test_what_is_typed_wrong_is_a_sentence_and_changes_nothing(session: Session, request_: dict[str, Any]) -> None:
    before = session.choices
    with pytest.raises(FingervisionError) as refused:
        obey(session, request_)
    words = str(refused.value)
    assert words.endswith(".")
    assert len(words) < 400
    assert "\n" not in words
    assert "None" not in words
    assert session.choices == before
    assert not list(session.out.glob("calibration_*"))


@pytest.mark.parametrize("request_", WRONG[-6:], ids=lambda each: json.dumps(each)[:60])
def test_what_cannot_be_asked_here_ends_nothing(session: Session, request_: dict[str, Any]) -> None:
    before = session.choices
    with suppress(FingervisionError):
        obey(session, request_)
    if session.recording is not None:
        session.stop_recording()
    assert session.choices == before


def test_a_scale_is_stated_with_its_uncertainty_and_saved_with_it(session: Session) -> None:
    obey(session, {"do": "scale", "px_per_mm": 34.0, "u_px_per_mm": 0.1})
    state = session.choices.state()
    assert (state["px_per_mm"], state["u_px_per_mm"]) == (34.0, pytest.approx(0.1))
    obey(session, {"do": "save_settings"})
    settings = read_settings(session.out / "settings.toml")
    assert (settings["px_per_mm"], settings["u_px_per_mm"]) == (34.0, pytest.approx(0.1))
    obey(session, {"do": "scale", "px_per_mm": 20.0, "u_px_per_mm": None})
    assert session.choices.state()["u_px_per_mm"] is None


TWENTY: list[Any] = [
    None, True, "", " ", "1;5", "1,234", "ten", "<script>alert(1)</script>", "../../etc/passwd", "\0", "\u0661", "NaN",
    [], [1.0], {}, {"value": 1}, float("nan"), float("inf"), -float("inf"), -1.0, 1e308, 10**400,
]  # fmt: skip
"""What may be typed, or sent by a page that was changed, where a positive number is asked for."""
CALIBRATE = {"do": "calibrate", "kind": "bar", "box": [200, 100, 240, 280], "size_mm": 2.0, "u_size_mm": 0.001}
FIELDS: list[tuple[dict[str, Any], str]] = [
    ({"do": "scale"}, "px_per_mm"),
    ({"do": "height"}, "below_tip_mm"),
    (CALIBRATE, "size_mm"),
    (CALIBRATE, "u_size_mm"),
    (CALIBRATE, "box"),
    (CALIBRATE, "kind"),
    ({"do": "region"}, "box"),
    ({"do": "tips"}, "tips"),
    ({"do": "fingers"}, "fingers"),
    ({"do": "load_settings"}, "path"),
    ({"do": "height_at"}, "y"),
    ({"do": "limits", "greatest": None}, "least"),
    ({"do": "limits", "least": None}, "greatest"),
    ({"do": "input"}, "input_mm"),
    ({"do": "seek"}, "frame"),
    ({"do": "play"}, "speed"),
    ({"do": "bed_move", "speed_mm_s": 1.0}, "to_mm"),
    ({"do": "bed_jog", "for_s": 0.1}, "speed_mm_s"),
    ({"do": "bed_run"}, "recipe"),
    ({"do": "gauge_add"}, "table"),
    ({"do": "gauge_remove"}, "name"),
    ({"do": "gauges_load"}, "path"),
]


@pytest.mark.parametrize(("request_", "field"), FIELDS, ids=[f"{each['do']} {field}" for each, field in FIELDS])
def test_twenty_wrong_things_in_every_field_change_no_measurement(
    session: Session, request_: dict[str, Any], field: str
) -> None:
    before = session.choices
    for wrong in TWENTY:
        with suppress(FingervisionError):
            obey(session, {**request_, field: wrong})
        found = session.choices
        # Nothing but a finite, positive scale and height is ever in force.
        assert found.scale == before.scale or isinstance(wrong, float), (field, wrong)
        assert isinstance(found.scale, BareScale | Calibration)
        assert 0.0 < found.scale.px_per_mm < 1e6, (field, wrong)
        assert 0.0 < found.below_tip_mm < 1e6, (field, wrong)
        assert np.isfinite(found.zero_mm), (field, wrong)


def test_two_pages_that_calibrate_at_once_are_one_writer_and_one_who_is_told(session: Session) -> None:
    ending = Event()
    page = Page(session, bound("127.0.0.1", 0))
    thread = Thread(target=page.serve, args=(ending,))
    thread.start()
    try:
        with socket_of(page.address) as first, socket_of(page.address) as second:
            pages, answers = {2.0: first, 3.0: second}, {}

            def calibrate(size_mm: float) -> None:
                answers[size_mm] = reply(pages[size_mm], {**CALIBRATE, "size_mm": size_mm})

            both = [Thread(target=calibrate, args=(size_mm,)) for size_mm in pages]
            for each in both:
                each.start()
            for each in both:
                each.join()
            (done,) = (size_mm for size_mm, answer in answers.items() if "refused" not in answer)
            (told,) = (size_mm for size_mm, answer in answers.items() if "refused" in answer)
            assert "Take over" in answers[told]["refused"]
            assert session.choices.scale is not None
            assert session.choices.scale.px_per_mm == pytest.approx(100.0 / done, rel=0.01)
            assert "refused" not in reply(pages[told], {"do": "take_over"})
            calibrate(told)
            assert session.choices.scale.px_per_mm == pytest.approx(100.0 / told, rel=0.01)
            assert len(list(session.out.glob("calibration_*.json"))) == 2
    finally:
        ending.set()
        thread.join()


def test_two_who_calibrate_in_the_same_second_keep_a_file_each(session: Session) -> None:
    answers: list[str] = []

    def calibrate(size_mm: float) -> None:
        asked = {"do": "calibrate", "kind": "bar", "box": [200, 100, 240, 280], "size_mm": size_mm, "u_size_mm": 0.001}
        answers.append(obey(session, asked).words)

    threads = [Thread(target=calibrate, args=(size_mm,)) for size_mm in (2.0, 3.0)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(answers) == 2
    files = sorted((session.out).glob("calibration_*.json"))
    assert len(files) == 2
    scales = {round(read_calibration(file).px_per_mm, 1) for file in files}
    assert scales == {50.0, 33.3}
    # What is in force is one of the two, with its own file.
    chosen = session.choices
    assert isinstance(chosen.scale, Calibration)
    assert chosen.scale_file is not None
    assert read_calibration(chosen.scale_file).px_per_mm == pytest.approx(chosen.scale.px_per_mm)


DROP = """name => {
  const data = new DataTransfer();
  data.items.add(new File(["x"], name, {type: ""}));
  const event = new DragEvent("drop", {dataTransfer: data, bubbles: true, cancelable: true});
  document.querySelector("#picture").dispatchEvent(event);
  return event.defaultPrevented;
}"""


@pytest.mark.slow
def test_a_dropped_file_leaves_the_page_where_it_is_and_a_second_page_is_told_who_writes(
    live: Callable[..., Any], opened: Callable[..., Any]
) -> None:
    view = live("simulated", "--port", "0")
    page = opened(view.address)
    shown(page, "Number(document.querySelector('#picture').dataset.shown) > 3")
    for name, words in (
        ("run 1.mp4", 'fingervision live "run 1.mp4"'),
        ("<img src=x>.docx", "<img src=x>.docx is neither a video nor a picture"),
        ("settings.toml", "settings.toml: type its path under Set-up"),
    ):
        assert page.evaluate(DROP, name) is True
        says(page, words)
    # The first to do something works the view; to open the panel of the gauges is such a thing already.
    unfold = "for (const one of document.querySelectorAll('#panels details')) one.open = true"
    page.evaluate(unfold)
    typed(page, "#size_mm", "2")
    other = opened(view.address)
    shown(other, "document.querySelector('#looks_on').offsetParent")
    other.evaluate(unfold)
    # Its fields are shut while the first works the view, until it takes over.
    shown(other, "document.querySelector('#size_mm').disabled && document.querySelector('#looks_on').offsetParent")
    other.click("#take_over")
    shown(page, "document.querySelector('#size_mm').disabled")
    shown(other, "!document.querySelector('#size_mm').disabled")
    shown(page, "Number(document.querySelector('#gap_mm').textContent) > 0")
