"""The true values of tests/benchmarks/world: the data of its generator agree with the stated effects.

`python -m tests.benchmarks.world.run` prints the results of the benchmark; these tests make no diagnosis.
"""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.hidden.catalogue_chain import RUN_START, driven
from tests.benchmarks.world import physics
from tests.benchmarks.world.at_rest import Parts, Reading, bidirectional, read_at_rest
from tests.benchmarks.world.definitions import samples_of
from tests.benchmarks.world.draw import draw_table, drawn
from tests.benchmarks.world.error_map import draw_map
from tests.benchmarks.world.marks import Marker
from tests.benchmarks.world.rig import Path as InputPath
from tests.benchmarks.world.rig import Rig
from tests.benchmarks.world.right_answers import FAR, right_answers
from tests.benchmarks.world.rows.catalogue import ROWS

SEED = 6001
BENCHMARK = Path(__file__).resolve().parents[1] / "benchmarks" / "world"
EXACT_MM = 1e-9
"""Rounding error of double-precision numbers over metres of travel."""
PLAY_MM = 0.02
OWN = ("tests.benchmarks.world", "tests.benchmarks.hidden", "tests.benchmarks.frame")


def test_the_benchmark_imports_nothing_of_the_product() -> None:
    allowed = {"numpy", "scipy", "tests"}
    standard = {"argparse", "collections", "concurrent", "dataclasses", "functools", "itertools", "json", "os",
                "pathlib", "subprocess", "sys", "time", "typing"}  # fmt: skip
    files = sorted(BENCHMARK.rglob("*.py"))
    assert len(files) > 20
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                modules = [node.module or ""]
            strange = [m for m in modules if m.split(".")[0] not in allowed | standard]
            assert not strange, f"{path.name} imports {strange}"
            inside = [m for m in modules if m.startswith("tests")]
            assert all(m.startswith(OWN) for m in inside)


def stage(parts: Parts, *, simulation: str = "line", zeroed: bool = False, noise_mm: float = 0.0005) -> Rig:
    stations = bidirectional(np.linspace(0.0, 50.0, 6), 4, 0.5, 20.0, 6.0, listed=True)
    reading = Reading(noise_mm, 0.0, 3.0, simulation, zeroed)
    return read_at_rest(np.random.default_rng(SEED), stations, parts, reading)


def by_direction(rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Differences from the simulation without noise, for motion up and for motion down."""
    up = np.diff(rig.input_mm, prepend=rig.input_mm[0] - 1) > 0
    away = rig.clean_gap_mm - rig.simulation.gap(rig.input_mm)
    return away[rig.read & up], away[rig.read & ~up]


@pytest.mark.parametrize("start", [-1.0, 0.3, 1.0])
def test_a_play_that_is_engaged_gives_a_reversal_of_its_width(start: float) -> None:
    up, down = by_direction(stage(Parts(play_mm=PLAY_MM, start=start)))
    # The stage overshoots at every end, so that its initial position has no influence.
    assert up == pytest.approx(-PLAY_MM / 2, abs=EXACT_MM)
    assert down == pytest.approx(PLAY_MM / 2, abs=EXACT_MM)


def test_a_reference_that_is_zeroed_shifts_everything_by_half_the_play() -> None:
    up, down = by_direction(stage(Parts(play_mm=PLAY_MM), zeroed=True))
    assert up == pytest.approx(0.0, abs=EXACT_MM)
    assert down == pytest.approx(PLAY_MM, abs=EXACT_MM)


def test_the_mean_of_the_readings_as_simulation_leaves_the_reversal_alone() -> None:
    bent = draw_map(np.random.default_rng(1), np.linspace(0.0, 50.0, 6), 0.01, 3)
    up, down = by_direction(stage(Parts(play_mm=PLAY_MM, error_map=bent), simulation="map"))
    # The slope of the map is at most some parts in a thousand, which acts over half of the play.
    assert up == pytest.approx(-PLAY_MM / 2, rel=5e-3)
    assert down == pytest.approx(PLAY_MM / 2, rel=5e-3)


def test_a_null_holds_nothing_but_its_noise() -> None:
    found = 0
    for row in ("iso_cycles", "sparse", "free_start", "wind_up", "hours"):
        for index in range(12):
            rig = drawn(row, SEED, index, 0)
            if rig.hidden:
                continue
            found += 1
            away = rig.clean_gap_mm[rig.read] - rig.simulation.gap(rig.input_mm[rig.read])
            assert np.abs(away).max() < EXACT_MM, f"{row} {index} ({rig.kind})"
            scatter = float(np.std(rig.gap_mm[rig.read] - rig.clean_gap_mm[rig.read]))
            assert scatter < 1.6 * rig.noise_mm
    assert found >= 8


@pytest.mark.parametrize("start", [-1.0, -0.4, 0.0, 1.0])
def test_the_judges_plays_and_sliders_are_the_generators(start: float) -> None:
    rng = np.random.default_rng(SEED)
    u = np.cumsum(rng.standard_normal(400))
    at = samples_of(InputPath.of_rows(np.arange(400.0), u, np.zeros(400, dtype=np.int64), at_rest=False))
    play = driven(at, {"backlash": np.array([2.5]), RUN_START: np.array([start])})
    assert play == pytest.approx(physics.play(u, 2.5, start), abs=EXACT_MM)
    # An elastic slider at its limit corresponds to a play engaged by upward motion.
    loop = driven(at, {"friction_hysteresis": np.array([0.3, 4.0]), RUN_START: np.array([start])})
    assert loop == pytest.approx(physics.friction_loop(u, 0.3, 4.0, -start), abs=EXACT_MM)


def test_a_command_is_delayed_exactly_and_held_between_its_lines() -> None:
    rig = next(r for r in (drawn("commands_with_steps", SEED, k, 0) for k in range(60))
               if r.kind == "square" and len(r.hidden) == 1)  # fmt: skip
    delay_s = rig.hidden[0].parameters["delay_s"]
    line = np.searchsorted(rig.time_s, rig.time_s - delay_s + 1e-9, side="right") - 1
    held = np.where(line >= 0, rig.input_mm[np.maximum(line, 0)], rig.input_mm[0])
    assert rig.clean_gap_mm == pytest.approx(1.0 + held, abs=1e-6)


def test_one_direction_of_an_engaged_play_is_an_offset() -> None:
    rig = next(r for r in (drawn("missing_directions", SEED, k, 0) for k in range(60))
               if r.kind.startswith("play"))  # fmt: skip
    right, _ = right_answers(rig)
    if right.nothing > FAR:
        (same,) = right.core
        assert {"backlash", "rest_gap_error", "input_offset"} <= same


def test_readings_at_rest_know_no_lag() -> None:
    right, judge = right_answers(stage(Parts(play_mm=PLAY_MM)))
    assert not {"drive_lag", "camera_latency", "slew_limit"} & set(judge.known)
    assert "backlash" in right.core[0]
    assert not {"rest_gap_error", "thermal_drift", "input_scale"} & right.core[0]


def report(verdict: str, *names: str, alternatives: tuple[tuple[str, ...], ...] = ()) -> dict[str, object]:
    effects = [{"name": n, "parameters": {}} for n in names]
    standing = {"before_rms_mm": 1.0, "after_rms_mm": 0.01, "noise_rms_mm": 0.01}
    return {"verdict": verdict, "effects": effects, "alternatives": alternatives, "disagreement": standing}


def test_marks(tmp_path: Path) -> None:
    index = next(k for k in range(60) if drawn("sparse", SEED, k, 0).kind == "play, both ways")
    truth = json.loads((draw_table("sparse", SEED, index, tmp_path) / "truth.json").read_text(encoding="utf-8"))
    marker = Marker(truth)

    def result(verdict: str, *names: str, **more: tuple[tuple[str, ...], ...]) -> str:
        return marker.mark(report(verdict, *names, **more)).result

    assert result("named", "backlash") == "exact"
    assert result("ambiguous", "thermal_drift", alternatives=(("thermal_drift",), ("backlash",))) == "set"
    assert result("named", "thermal_drift") == "wrong"
    assert result("named", "backlash", "thermal_drift") == "wrong"
    assert result("agrees") == "false agrees"
    assert result("unknown") == "unknown"


@pytest.mark.parametrize("row", sorted(ROWS))
def test_every_row_draws_a_table_as_diagnose_takes_it(row: str) -> None:
    for index in range(3):
        rig = drawn(row, SEED, index, 0)
        assert rig.input_mm.size == rig.gap_mm.size == rig.read.size == rig.run.size == rig.path.row.size
        assert rig.read.sum() >= 10
        assert np.all(np.isfinite(rig.gap_mm))
        low, high = rig.simulation.input_mm[[0, -1]]
        assert low <= rig.input_mm.min()
        assert rig.input_mm.max() <= high
        for run in np.unique(rig.run) if not rig.may_refuse else ():
            assert np.all(np.diff(rig.time_s[rig.run == run]) > 0)
