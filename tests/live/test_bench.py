"""Control of the test bed from the page: limits as in the command, stop by any user, motion only with permission."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest

from calib.calibration import BareScale
from fingervision.domain.errors import FingervisionError, StateError, UsageError
from fingervision.domain.status import Status
from fingervision.frames.source import Received
from fingervision.live.bed.bench import Bench
from fingervision.live.capture import Capture
from fingervision.live.choices import Choices
from fingervision.live.commands import obey, section
from fingervision.live.comparison.comparison import turns
from fingervision.live.preview import ROWS_AT_ONCE
from fingervision.live.session import Session
from fingervision.storage.gaps_csv import GapRow
from fingervision.testbed.bed_factory import open_bed
from tests.live.browser import browser, opened, says, shown, typed
from tests.waiting import until

__all__ = ["browser", "opened"]
# A bed that goes faster than time, so that nobody waits.
PACE = 20.0
RECIPE = """schema = 1
name = "there and back"
below_force_n = 5.0
[[step]]
kind = "triangle"
from_mm = -0.2
to_mm = 0.8
speed_mm_s = 0.5
cycles = 1
frames = "continuous"
"""


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    """A simulated test bed with its thread running, whose frames are read."""
    monkeypatch.chdir(tmp_path)
    found = Bench(open_bed("simulated", pace=PACE))
    frames: list[Received] = []
    found.frames = frames  # type: ignore[attr-defined]
    Thread(target=lambda: frames.extend(found.received()), daemon=True).start()
    yield found
    found.close()


@pytest.fixture
def session(bench: Bench, tmp_path: Path) -> Session:
    found = Session(Capture(bench, None), Choices(scale=BareScale(34.0)), tmp_path / "out")
    found.features |= {"bed": bench, "allow_motion": True}
    bench.say = found.say
    return found


def done(session: Session, bench: Bench, request: dict[str, Any]) -> str:
    """Request a motion, wait for its end, and return the last message."""
    before = len(session.messages)
    obey(session, request)
    until(lambda: not bench.doing and len(session.messages) > before)
    return session.messages[-1].words


def test_what_the_bed_may_not_do_is_refused_and_nothing_moves(session: Session, bench: Bench, tmp_path: Path) -> None:
    until(lambda: bench.description)
    for request in (
        {"do": "bed_move", "to_mm": 99.0, "speed_mm_s": 0.5},
        {"do": "bed_move", "to_mm": 1.46, "speed_mm_s": 0.5},
        {"do": "bed_move", "to_mm": 0.5, "speed_mm_s": 0.0},
        {"do": "bed_move", "to_mm": 0.5, "speed_mm_s": -1.0},
        {"do": "bed_move", "to_mm": 0.5, "speed_mm_s": 1e9},
        {"do": "bed_jog", "speed_mm_s": 0.0, "for_s": 1.0},
    ):
        assert "nothing was moved" in done(session, bench, request)
        assert bench.position_mm == 0.0
    outside = tmp_path.parent / "outside.toml"
    outside.write_text(RECIPE)
    for request in (
        {"do": "bed_move", "to_mm": "0,5 px", "speed_mm_s": 0.5},
        {"do": "bed_move", "to_mm": float("nan"), "speed_mm_s": 0.5},
        {"do": "bed_move", "speed_mm_s": 0.5},
        {"do": "bed_jog", "speed_mm_s": 0.5, "for_s": 11.0},
        {"do": "bed_jog", "speed_mm_s": 0.5, "for_s": 0.0},
        {"do": "bed_run", "recipe": "missing.toml"},
        {"do": "bed_run", "recipe": "../outside.toml"},
        {"do": "bed_run", "recipe": "/etc/passwd"},
        {"do": "bed_run", "recipe": 7},
        {"do": "bed_run", "recipe": "x" * 5000},
    ):
        with pytest.raises((UsageError, FingervisionError)):
            obey(session, request)
    assert bench.position_mm == 0.0


def test_moves_and_jogs_end_where_they_should(session: Session, bench: Bench) -> None:
    assert done(session, bench, {"do": "bed_move", "to_mm": 0.6, "speed_mm_s": 0.5}).startswith("At 0.6")
    assert bench.position_mm == pytest.approx(0.6, abs=0.03)
    # A jog without end stops at the bed's limit.
    done(session, bench, {"do": "bed_jog", "speed_mm_s": 0.5, "for_s": 10.0})
    assert bench.position_mm == pytest.approx(1.45, abs=0.09)
    done(session, bench, {"do": "bed_home"})
    assert bench.position_mm == pytest.approx(0.0, abs=0.03)
    inputs = [each.driven.input_mm for each in bench.frames]  # type: ignore[attr-defined]
    assert max(inputs) == pytest.approx(1.45, abs=0.09)


def test_anybody_stops_and_only_who_may_moves(session: Session, bench: Bench) -> None:
    session.features["allow_motion"] = False
    for request in (
        {"do": "bed_move", "to_mm": 0.5, "speed_mm_s": 0.5},
        {"do": "bed_jog", "speed_mm_s": 0.5, "for_s": 1.0},
        {"do": "bed_home"},
        {"do": "bed_run", "recipe": "recipe.toml"},
    ):
        with pytest.raises(StateError, match="allow motions"):
            obey(session, request)
    session.features["allow_motion"] = True
    obey(session, {"do": "bed_move", "to_mm": 1.4, "speed_mm_s": 0.1})
    until(lambda: bench.position_mm > 0.1)
    with pytest.raises(StateError, match="stop it first"):
        obey(session, {"do": "bed_home"})
    session.features["allow_motion"] = False
    obey(session, {"do": "bed_stop"})
    until(lambda: not bench.doing)
    assert bench.position_mm < 1.3


def test_a_recipe_runs_and_is_stopped(session: Session, bench: Bench, tmp_path: Path) -> None:
    (tmp_path / "recipe.toml").write_text(RECIPE.replace("to_mm = 0.8", "to_mm = 0.2"))
    words = done(session, bench, {"do": "bed_run", "recipe": "recipe.toml"})
    assert "frames" in words
    (run,) = (tmp_path / "out").glob("bed_*")
    rows = (run / "samples.csv").read_text().splitlines()[1:]
    given = [each.driven for each in bench.frames if each.driven.run == "2"]  # type: ignore[attr-defined]
    # The live rows bear the inputs that the run's table has.
    assert [round(each.input_mm, 7) for each in given] == [float(row.split(",")[2]) for row in rows]
    obey(session, {"do": "bed_run", "recipe": "recipe.toml"})
    until(lambda: bench.progress and bench.progress[0] > 0.5)
    obey(session, {"do": "bed_stop"})
    until(lambda: not bench.doing)
    assert any("The run was stopped" in each.words for each in session.messages)
    told = section(session)["bed"]
    assert told["doing"] == ""
    assert told["limits"]["upper_mm"] == 1.45


def test_turns_are_counted_beyond_the_noise() -> None:
    def rows(*inputs: float | None) -> list[GapRow]:
        return [GapRow(i, i / 25, Status.OK, gap_mm=1.0, input_mm=each) for i, each in enumerate(inputs)]

    assert turns(rows(0.0, 0.001, 0.0, 0.001, 0.0), 0.01) == 0
    assert turns(rows(0.0, 0.5, 1.0), 0.01) == 0
    assert turns(rows(0.0, 1.0, None, 0.0), 0.01) == 1
    assert turns(rows(0.0, -0.3, 1.0, -0.3), 0.01) == 2
    assert turns([], 0.01) == 0


@pytest.mark.slow
def test_a_hidden_backlash_is_named_on_the_page_within_a_minute_of_motion(
    live: Callable[..., Any], opened: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "recipe.toml").write_text(RECIPE)
    hidden = ("--hide", "backlash:play_mm=0.03", "--allow-motion")
    view = live("simulated", "--bed", "simulated", *hidden, "--port", "0")
    page = opened(view.address, viewport={"width": 1280, "height": 720})
    shown(page, "document.querySelector('#status').textContent === 'ok'")
    typed(page, "#bed_to", "9")
    says(page, "nothing was moved")
    typed(page, "#bed_recipe", "recipe.toml")
    says(page, "Running there and back")
    shown(page, "document.querySelector('#verdict_effects').textContent.includes('backlash')")
    # Motion: the recipe's own 4 s and the way there, less than a minute.
    found = float(page.inner_text("#verdict_effects").split("play ")[1].split()[0])
    assert found == pytest.approx(0.03, abs=0.001)
    # The verdict is one sentence, and what it stands on is said where one asks why.
    words = page.inner_text("#verdict_words").removesuffix(" (being judged anew)")
    assert words.startswith("named: ")
    assert ". " not in words
    page.click("#verdict_why summary")
    assert re.search(r"From \d+ samples", page.inner_text("#verdict_more"))
    assert page.locator("#bed_stop").is_visible()
    page.locator("body").press("Escape")
    says(page, "Stopped.")


class Asked:
    """Records which tables are diagnosed."""

    def __init__(self) -> None:
        self.tables: list[list[GapRow]] = []

    def __call__(self, rows: list[GapRow]) -> None:
        self.tables.append(rows)


def test_a_verdict_is_sought_after_a_motion_there_and_back_and_a_long_rest_does_not_outweigh_it(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingervision.live.comparison.comparison import Comparison

    table = tmp_path / "model.csv"
    table.write_text("input_mm,gap_mm\n-1,1\n2,10\n")
    comparison = Comparison(session, table)
    asked = Asked()
    monkeypatch.setattr(comparison.verdicts, "_seek", asked)

    def rows(*inputs: float) -> None:
        for input_mm in inputs:
            number = comparison._total
            comparison.add(GapRow(number, number / 25, Status.OK, gap_mm=4 + 3 * input_mm, input_mm=input_mm))

    rows(*[0.0] * 500)
    rows(*np.linspace(0.0, 1.0, 200))
    assert asked.tables == []
    rows(*np.linspace(1.0, 0.0, 200))
    rows(*[0.0] * 500)
    assert asked.tables
    last = asked.tables[-1]
    resting = sum(1 for row in last if row.input_mm == 0.0)
    assert len(last) - resting > 350
    assert resting < 100
    count = len(asked.tables)
    rows(*[0.0] * 1000)
    assert len(asked.tables) == count
    residual = comparison.state()
    assert residual["rms_um"] == pytest.approx(0.0, abs=1e-9)


def test_a_prediction_follows_the_inputs_path_where_the_model_has_a_memory(tmp_path: Path) -> None:
    from fingervision.live.comparison.comparison import Prediction
    from fingervision.tables.read import read_model

    (tmp_path / "base.csv").write_text("input_mm,gap_mm\n-1,1\n2,10\n")
    (tmp_path / "model.toml").write_text(
        'schema = 1\nbase = "base.csv"\n[[effect]]\nname = "backlash"\n[effect.parameters]\n'
        "play_mm = { value = 0.1, u = 0.001 }\n"
    )
    prediction = Prediction(read_model(tmp_path / "model.toml"))
    way = [*np.linspace(0.0, 1.0, 41), *np.linspace(1.0, 0.0, 41)]
    rows = [GapRow(i, i / 25, Status.OK, gap_mm=4.0, input_mm=float(at)) for i, at in enumerate(way)]
    # Rows of a recording come once before their inputs are known.
    assert set(prediction.predicted_mm([replace(row, input_mm=None) for row in rows])) == {None}
    found = [prediction.predicted_mm([row])[0] for row in rows]
    # Up and down, the same input differs by the play times the slope of 3.
    assert found[20] is not None
    assert found[61] is not None
    assert found[61] - found[20] == pytest.approx(3.0 * 0.1, abs=0.01)
    assert prediction.predicted_mm(rows) == found
    # As many rows as a page is sent at once, of which none is left out.
    prediction.clear()
    many = [GapRow(i, i / 25, Status.OK, gap_mm=4.0, input_mm=float(i % 40) / 40) for i in range(ROWS_AT_ONCE)]
    assert None not in prediction.predicted_mm(many)
    beyond = GapRow(5000, 300.0, Status.OK, gap_mm=4.0, input_mm=9.0)
    assert prediction.predicted_mm([beyond]) == [None]
