"""The test bed as bluesky devices, with a real RunEngine: scans, flights, a stop, and the agent for the next run."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bluesky", reason="the extra `bluesky` is not installed")

import bluesky.plan_stubs as bps
import bluesky.plans as bp
from bluesky import RunEngine
from bluesky.protocols import Flyable, Movable, Readable, Stoppable, Triggerable

import fingervision as fv
from fingervision.adapters.bluesky import Devices, ThreadStatus, devices
from fingervision.adapters.bluesky_agent import NextRunAgent, run_steps
from fingervision.domain.camera import Origin
from fingervision.domain.errors import DataError, FingervisionError, LimitError, StateError
from fingervision.measuring.camera_learning import WANTED
from fingervision.tables.read import read_model
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.simulation.injected_effects import Hidden
from tests.docs.examples import blocks_of

PLAY_MM, GAIN = 0.12, 7.7
# The computer may be loaded by other tests.
PATIENCE_S = 120.0
pytestmark = pytest.mark.filterwarnings("default")  # warnings of bluesky and its libraries


@pytest.fixture
def made() -> Iterator[Devices]:
    bed = open_bed("simulated", Hidden({"backlash": {"play_mm": PLAY_MM}}), pace=1.0)
    yield devices(bed)
    bed.close()


@pytest.fixture(scope="module")
def engine() -> Iterator[RunEngine]:
    engine = RunEngine({}, context_managers=[])
    yield engine
    engine.loop.call_soon_threadsafe(engine.loop.stop)
    engine._th.join(5.0)


def documents(engine: RunEngine, plan: Any) -> list[tuple[str, dict[str, Any]]]:
    seen: list[tuple[str, dict[str, Any]]] = []
    engine(plan, lambda name, document: seen.append((name, document)))
    return seen


def rows(seen: list[tuple[str, dict[str, Any]]], key: str) -> list[Any]:
    out = []
    for name, document in seen:
        if name == "event" and key in document["data"]:
            out.append(document["data"][key])
        if name == "event_page" and key in document["data"]:
            out += document["data"][key]
    return out


def test_the_devices_keep_blueskys_protocols(made: Devices) -> None:
    for protocol in (Readable, Movable, Stoppable, Flyable):
        assert isinstance(made.stage, protocol)
    for protocol in (Readable, Triggerable, Flyable):
        assert isinstance(made.gap, protocol)
    assert isinstance(made.force, Readable)


@pytest.mark.slow
def test_a_scan_moves_and_measures_at_each_place(made: Devices, engine: RunEngine) -> None:
    seen = documents(engine, bp.list_scan([made.gap, made.force], made.stage, [0.0, 0.3, 0.6]))
    np.testing.assert_allclose(
        rows(seen, "stage"), [0.0, 0.3, 0.6], atol=0.11
    )  # from the stage's accuracy and its encoder
    gaps, inputs = np.array(rows(seen, "gap_gap_mm")), np.array(rows(seen, "gap_input_mm"))
    # The play is taken up in the first motion; afterwards, the gap follows the input.
    assert gaps[2] - gaps[1] == pytest.approx(GAIN * (inputs[2] - inputs[1]), abs=GAIN * 0.03)
    assert gaps[1] - gaps[0] == pytest.approx(GAIN * (inputs[1] - inputs[0] - 0.5 * PLAY_MM), abs=GAIN * 0.03)
    np.testing.assert_allclose(inputs, rows(seen, "stage"), atol=0.03)
    assert set(rows(seen, "gap_status")) == {"ok"}
    assert all(abs(force) < 5.5 for force in rows(seen, "force"))


@pytest.mark.slow
def test_a_flight_gives_an_event_a_frame_and_the_agent_names_what_is_hidden(
    made: Devices, engine: RunEngine, tmp_path: Path
) -> None:
    assert made.gap is not None
    table = tmp_path / "simulation.csv"
    ideal = open_bed("simulated")
    assert ideal.model is not None
    inputs = np.linspace(-1.0, 2.0, 61)
    answer = ideal.model.respond(inputs)
    ideal.close()
    lines = [f"{u},{g}" for u, g in zip(inputs.tolist(), answer.gap_mm.tolist(), strict=True)]
    table.write_text("input_mm,gap_mm\n" + "\n".join(lines) + "\n", encoding="utf-8")
    agent = NextRunAgent(read_model(table))
    token = engine.subscribe(agent)
    steps = [{"kind": "triangle", "from_mm": 0.0, "to_mm": 1.0, "speed_mm_s": 0.8, "cycles": 2}]
    seen = documents(engine, run_steps(steps, made.stage, made.gap))
    engine.unsubscribe(token)
    inputs = np.array(rows(seen, "gap_input_mm"))
    assert inputs.size > 25  # 125 frames if the machine is fast enough
    assert np.ptp(inputs) == pytest.approx(1.0, abs=0.2)
    report = agent.report().report
    assert ["backlash"] in [list(names) for names in report.alternatives], report.sentence
    suggested = agent.suggest()
    assert bool(suggested) == (report.next_run is not None)


def test_events_are_measured_by_the_camera_that_the_first_frames_show(made: Devices) -> None:
    assert made.gap is not None
    flown: list[Any] = []
    for target_mm in (0.2, 0.0, 0.2, 0.0):  # a busy machine takes fewer pictures in a flight
        made.gap.kickoff()
        made.stage.prepare((target_mm, 0.5))
        made.stage.kickoff()
        assert made.stage.complete().exception(PATIENCE_S) is None
        assert made.gap.complete().exception(PATIENCE_S) is None
        flown += made.gap.collect()
        if len(flown) >= WANTED:
            break
    assert made.gap.trigger().exception(PATIENCE_S) is None
    assert made.gap._sight.settings.camera.response.origin is Origin.LEARNT
    assert len(flown) >= WANTED
    assert {event["data"]["gap_status"] for event in flown} == {"ok"}


def test_a_flight_of_the_stage_gives_its_readings(made: Devices, engine: RunEngine) -> None:
    def flight() -> Iterator[Any]:
        yield from bps.open_run()
        yield from bps.prepare(made.stage, (0.3, 1.0), wait=True)
        yield from bps.kickoff(made.stage, wait=True)
        yield from bps.complete(made.stage, wait=True)
        yield from bps.collect(made.stage)
        yield from bps.close_run()

    positions = rows(documents(engine, flight()), "stage")
    assert len(positions) > 20
    assert positions[-1] == pytest.approx(0.3, abs=0.11)


def test_a_stop_ends_a_motion(made: Devices) -> None:
    status = made.stage.set(1.4)
    assert not status.done
    made.stage.stop()
    assert status.exception(5.0) is None
    assert made.stage.read()["stage"]["value"] < 1.2


def test_beyond_the_limits_nothing_moves(made: Devices) -> None:
    before = made.stage.read()["stage"]["value"]
    with pytest.raises(LimitError, match="nothing was moved"):
        made.stage.set(100.0)
    with pytest.raises(StateError, match="prepared"):
        made.stage.kickoff()
    assert made.stage.read()["stage"]["value"] == before
    assert made.gap is not None
    with pytest.raises(StateError, match="triggered"):
        made.gap.read()


def test_a_bed_of_the_interface_gives_the_devices_if_it_runs_in_real_time() -> None:
    with fv.bed(real_time=True) as bed:
        assert isinstance(devices(bed).stage, Movable)
    with fv.bed() as bed, pytest.raises(fv.ArgumentError, match="real_time=True"):
        devices(bed)
    with pytest.raises(fv.ArgumentTypeError, match="str"):
        devices("simulated")


@pytest.mark.slow
def test_the_manuals_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    root = Path(__file__).parents[2]
    (block,) = (block for block in blocks_of(root / "docs/how_to/bluesky.md", root) if block.language == "python")
    exec(block.body, {})
    assert capsys.readouterr().out.count(", ok") == 3


def test_a_status_tells_its_failure_and_calls_back_once() -> None:
    hold, called = threading.Event(), []

    def fails() -> None:
        hold.wait(5.0)
        raise FingervisionError("no")

    status = ThreadStatus(fails)
    status.add_callback(called.append)
    with pytest.raises(TimeoutError):
        status.exception(0.0)
    hold.set()
    assert isinstance(status.exception(5.0), FingervisionError)
    assert not status.success
    status.add_callback(called.append)
    for _ in range(500):
        if len(called) == 2:
            break
        threading.Event().wait(0.01)
    assert called == [status, status]


def test_rows_without_an_input_and_strange_steps_are_refused(made: Devices, engine: RunEngine, tmp_path: Path) -> None:
    table = tmp_path / "s.csv"
    table.write_text("input_mm,gap_mm\n0,4\n1,11.7\n", encoding="utf-8")
    with pytest.raises(DataError, match="input_mm"):
        NextRunAgent(read_model(table)).ingest([{"gap_mm": 1.0}])
    assert made.gap is not None
    with pytest.raises(DataError, match="pirouette"):
        list(run_steps([{"kind": "pirouette"}], made.stage, made.gap))


def test_the_agent_uses_the_times_of_the_exposures(tmp_path: Path) -> None:
    table = tmp_path / "simulation.csv"
    table.write_text("input_mm,gap_mm\n-0.5,0.5\n1.5,8.5\n", encoding="utf-8")
    agent = NextRunAgent(read_model(table))
    time_s = np.arange(0.0, 12.0, 0.04)
    input_mm = 0.5 - 0.5 * np.cos(time_s)
    # A delay of 0.2 s, which only the times can show. A flight's documents are written together, after the flight.
    gap_mm = 2.5 + 4.0 * (0.5 - 0.5 * np.cos(time_s - 0.2) - 0.5 * (time_s < 0.2) * (1.0 - np.cos(time_s - 0.2)))
    gap_mm += np.random.default_rng(11).normal(0.0, 0.001, time_s.size)
    data = {"gap_input_mm": input_mm.tolist(), "gap_gap_mm": gap_mm.tolist()}
    written_s = (100.0 + 1e-4 * np.arange(time_s.size)).tolist()
    agent("start", {})
    agent("event_page", {"time": written_s, "data": data, "timestamps": dict.fromkeys(data, time_s.tolist())})
    found = agent.report()
    assert set(found.report.alternatives) == {("drive_lag",), ("camera_latency",)}, found.report.sentence
    assert found.report.effects[0].parameters["delay_s"].value == pytest.approx(0.2, abs=0.002)
