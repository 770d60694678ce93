"""Gauges on a live source: unchanged gauges continue, drawn gauges start anew; without a scale, no readings."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from calib.calibration import BareScale
from fingervision.cli import cli
from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.frames.source import Wish
from fingervision.live.beside import Beside, stand_beside
from fingervision.live.choices import Choices
from fingervision.live.commands import obey, section
from fingervision.live.gauge_course import GaugeCourse
from fingervision.live.live_gauges import put_live_gauges
from fingervision.live.opening import opened
from fingervision.live.preview import Known, message
from fingervision.live.server import save_gauges
from fingervision.live.session import Session
from tests.csv_rows import csv_rows
from tests.gauges.drawn import bar, drawn, half_plane, seen

WIDTH, HEIGHT, PER_FRAME = 640, 480, 3.0
EDGE = {"name": "edge", "kind": "edge", "x_px": 200, "y_px": 240, "direction_deg": 0, "length_px": 60, "reach_px": 8}
BAR = {"name": "bar", "kind": "pair", "x_px": 400, "y_px": 240, "direction_deg": 0.0, "distance_px": 30,
       "length_px": 50, "reach_px": 6}  # fmt: skip


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    """An edge that moves by 3 px per frame, and a bar at rest."""
    rng = np.random.default_rng(5)
    found = []
    for number in range(8):
        # All rows are alike.
        light = drawn((1, WIDTH), 60, [(half_plane(200 + PER_FRAME * number, 0, 0.0), 160), (bar(400, 0, 0.0, 30), 60)])
        found.append(Frame(seen(light.repeat(HEIGHT, axis=0), 1.0, rng), number, 0.04 * number))
    return found


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    """A live view that has not started."""
    view = Session(opened("simulated", Wish()), Choices(scale=BareScale(10.0)), tmp_path)
    yield view
    view.capture.source.close()


def read(session: Session, frame: Frame | LostFrame) -> list[dict]:
    for look in session.on_picture:
        look(frame, None)
    beside = session.features["gauges"]
    return beside.following.readings(frame.index, beside.board.version)


def test_an_unchanged_gauge_is_followed_on_while_another_is_added(
    session: Session, frames: list[Frame], tmp_path: Path
) -> None:
    assert section(session)["gauges"] == {"is_open": False}
    put_live_gauges(session, tmp_path / "gauges.toml", is_asked_for=True)
    obey(session, {"do": "gauge_add", "table": EDGE})
    for frame in frames[:6]:
        (edge,) = read(session, frame)
        assert edge["status"] == "ok"
    # By now the edge lies 15 px from where it was drawn, twice its reach: begun anew it would be lost.
    obey(session, {"do": "gauge_add", "table": BAR})
    edge, pair = read(session, frames[6])
    expected = (200 + 6 * PER_FRAME - 0.5 * (WIDTH - 1)) / 10.0
    assert edge["cells"][0][1] == pytest.approx(expected, abs=5e-3)
    assert pair["cells"][0][1] == pytest.approx(3.0, abs=5e-3)
    obey(session, {"do": "gauge_change", "name": "edge", "changes": {"length_px": 50}})
    edge, pair = read(session, frames[7])
    assert edge["status"] != "ok"
    assert pair["status"] == "ok"
    obey(session, {"do": "gauges_save"})
    assert "bar" in (tmp_path / "gauges.toml").read_text()


def test_a_lost_frame_a_hurry_and_a_missing_scale_give_no_number_and_say_so(
    session: Session, frames: list[Frame], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_beside(session, Beside(gauges=tmp_path / "gauges.toml"))
    obey(session, {"do": "gauge_add", "table": EDGE})
    assert read(session, frames[0])[0]["status"] == "ok"
    (lost,) = read(session, LostFrame(1, 0.04, Status.DAMAGED, "cut off"))
    assert (lost["status"], lost["cells"], lost["words"]) == ("damaged", [], "cut off")
    for again in range(32):
        assert read(session, Frame(frames[0].pixels, 10 + again, 0.0))[0]["status"] == "ok"
    following = session.features["gauges"].following
    assert [row.status for row in session.features["gauges"].rows] == ["ok", "damaged"] + ["ok"] * 32
    with monkeypatch.context() as patch:
        patch.setattr(Session, "in_a_hurry", True)
        assert read(session, Frame(frames[0].pixels, 90, 0.0)) is None
    assert "1 of the last 35 frames" in following.trouble
    session.choices = Choices()
    assert read(session, Frame(frames[0].pixels, 91, 0.0)) is None
    assert "scale" in following.trouble


def test_a_changed_gauge_begins_a_new_series_and_the_others_go_on(
    session: Session, frames: list[Frame], tmp_path: Path
) -> None:
    put_live_gauges(session, tmp_path / "gauges.toml", is_asked_for=True)
    obey(session, {"do": "gauge_add", "table": EDGE})
    obey(session, {"do": "gauge_add", "table": BAR})
    read(session, frames[0])
    first = message(session, Known(), None)
    told = headed(first.content)["gauge_points"]
    (edge, name, quantities), (bar_number, _, _) = told["gauges"]
    assert (name, quantities) == ("edge", [["position", "mm"]])
    assert [row[1] for row in told["rows"]] == [0]
    obey(session, {"do": "gauge_change", "name": "edge", "changes": {"length_px": 50}})
    read(session, frames[1])
    told = headed(message(session, first.known, None).content)["gauge_points"]
    assert [each[0] for each in told["gauges"]] != [edge, bar_number]
    assert bar_number in [each[0] for each in told["gauges"]]
    assert [row[1] for row in told["rows"]] == [1]
    # What is saved are the gauges as they are now.
    rows = session.features["gauges"].rows
    assert [(row.gauge, row.time_s) for row in rows] == [("bar", 0.0), ("edge", 0.04), ("bar", 0.04)]
    (path := tmp_path / "saved.csv").write_bytes(save_gauges(session).read_bytes())
    assert [row["value"] for row in csv_rows(path)] == [f"{row.value:.7f}" for row in rows]


def test_readings_are_kept_as_long_as_a_live_chart_goes_back() -> None:
    course, most = GaugeCourse(8), 8
    for frame in range(50):
        course.add(frame, 0.04 * frame, 1, [])
        assert course.find(frame) is not None
    assert course.find(50 - 2 * most) is None
    begun, first, entries = course.after(0, 47, 100)
    assert (begun, first, [entry.frame for entry in entries]) == (0, 47, [47, 48, 49])
    # Somebody who knows frames of before gets all that is kept.
    assert course.after(0, 3, 100)[1] == course.after(7, 3, 100)[1] >= 50 - 1.25 * most
    course.begin()
    assert course.after(0, 50, 100) == (1, 0, [])


def headed(content: bytes) -> dict:
    return json.loads(content[4 : 4 + int.from_bytes(content[:4], "big")])


def test_gauges_need_the_page() -> None:
    result = CliRunner().invoke(cli, ["live", "simulated", "--no-page", "--px-per-mm", "34", "--gauges", "gauges.toml"])
    assert isinstance(result.exception, UsageError)
    assert "--no-page" in str(result.exception)
