"""A run on the simulated test bed: the table is correct, its video gives the same values, and the results are
repeatable.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.domain.with_uncertainty import with_uncertainty
from fingervision.frames.source import open_source
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.samples_csv import read_samples
from fingervision.storage.simulation_table import read_simulation_table
from fingervision.testbed.simulation.injected_effects import Hidden
from fingervision.vision.pipeline import Settings, measure_frame
from tests.testbed.simulated_beds import recipe_at, run, steps

# Frames of 640 columns with noise of 2 grey levels: 0.014 px of each gap, 0.4 um. The tolerance is five times that, and
# the uncertainty of the stage's position.
GAP_MM = 0.004
# Motions of a sine are too short to interpolate the position between two steps of the encoder: one step, times 7.75 mm
# of gap per mm.
WITHIN_A_STEP_MM = 0.03 * 7.75


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("short")
    run(folder)
    return folder / "run"


@pytest.mark.slow
def test_the_gap_is_that_of_the_gripper_at_the_recorded_input(short: Path) -> None:
    table, model = read_measured_table(short / "samples.csv"), read_simulation_table(short / "simulation.csv")
    assert np.max(np.abs(table.gap_mm - model.respond(table.input_mm).gap_mm)) < GAP_MM
    assert np.ptp(table.input_mm) > 0.5


def test_runs_points_and_clocks_are_as_the_recipe_says(short: Path) -> None:
    rows = read_samples(short / "samples.csv")
    assert {row.run for row in rows} == {"1", "2 rezeroed"}
    assert [row.frame for row in rows] == list(range(len(rows)))
    # Three levels with three frames each, which are recorded after the picture came to rest.
    levels = [row for row in rows if row.step == 2]
    assert len(levels) == 9
    for k in range(3):
        assert np.ptp([row.gap_mm for row in levels[3 * k : 3 * k + 3]]) < GAP_MM
    times = [row.time_s for row in rows]
    assert times[0] == 0.0
    assert np.all(np.diff(times) > 0.0)
    about = json.loads((short / "run.json").read_text())
    assert about["complete"] is True
    assert about["frames"] == len(rows)
    assert 0.0 < about["clocks"]["camera"]["u_s"] < 0.002
    assert 0.0 < about["clocks"]["actuator"]["u_s"] < 0.002


def test_measuring_the_video_again_gives_the_table(short: Path) -> None:
    rows = read_samples(short / "samples.csv")
    frames = list(open_source(str(short / "video.mp4")))
    assert len(frames) == len(rows)
    for k in (0, len(rows) // 2, len(rows) - 1):
        measured = measure_frame(frames[k], Settings(0.3 * 34.0))  # type: ignore[arg-type]
        assert measured.gap_px / 34.0 == pytest.approx(rows[k].gap_mm, abs=1e-6)  # type: ignore[union-attr]
        assert frames[k].time_s == pytest.approx(rows[k].time_s, abs=1e-6)


def test_the_same_run_gives_the_same_table(short: Path, tmp_path: Path) -> None:
    run(tmp_path)
    assert (tmp_path / "run" / "samples.csv").read_bytes() == (short / "samples.csv").read_bytes()


@pytest.mark.slow
def test_every_kind_of_step_is_done(tmp_path: Path) -> None:
    said: list[str] = []
    text = steps(
        'kind = "sine"\nmean_mm = 0.2\namplitude_mm = 0.1\nfrequency_hz = 1.0\ncycles = 1',
        'kind = "hold"\nat_mm = 0.1\nseconds = 0.2',
        'kind = "turn_part_180"',
        'kind = "move"\nto_mm = 0.3\nspeed_mm_s = 1.0\nframes = 2',
        'kind = "turn_part_180"',
        'kind = "shift_picture"',
        'kind = "move"\nto_mm = 0.2\nspeed_mm_s = 1.0\nframes = 2',
        'kind = "reference_slot"\nsize_mm = 4.0\nu_size_mm = 0.002',
        'kind = "close_until_contact"\nspeed_mm_s = 0.5\nbelow_force_n = 0.5',
    )
    run(tmp_path, text, say=said.append)
    rows = read_samples(tmp_path / "run" / "samples.csv")
    model = read_simulation_table(tmp_path / "run" / "simulation.csv")
    assert {row.status.value for row in rows} == {"ok"}
    gaps, inputs = np.array([row.gap_mm for row in rows]), np.array([row.input_mm for row in rows])
    assert np.max(np.abs(gaps - model.respond(inputs).gap_mm)) < WITHIN_A_STEP_MM
    assert {row.run for row in rows} == {"1", "2 turned", "4"}  # nothing was recorded in run 3
    (slot,) = json.loads((tmp_path / "run" / "run.json").read_text())["reference_slots"]
    # An error of 0.01 px of each edge, at 34 px/mm.
    assert slot["measured_mm"] == pytest.approx(4.0, abs=5e-4)
    assert said == [f"The slot of 4 mm measures {with_uncertainty(slot['measured_mm'], slot['u_random_mm'])} mm."]
    # The gripper closed at 0.5 mm/s until the force was 0.5 N (2.08 N/mm): the stage is within the distance of one
    # frame.
    assert rows[-1].input_mm == pytest.approx(-0.24, abs=0.05)


@pytest.mark.slow
def test_what_is_hidden_acts_where_it_belongs(tmp_path: Path) -> None:
    text = steps('kind = "triangle"\nfrom_mm = 0.0\nto_mm = 0.6\nspeed_mm_s = 1.0')
    tables = {}
    for name, values in {
        "nothing": {},
        "backlash": {"play_mm": 0.1},
        "edge_bias": {"offset_mm": 0.06},
        "camera_drift": {"rate_mm_per_s": 0.05},
    }.items():
        (tmp_path / name).mkdir()
        run(tmp_path / name, text, Hidden({name: values} if values else {}))
        tables[name] = read_measured_table(tmp_path / name / "run" / "samples.csv")
    bare, played = tables["nothing"], tables["backlash"]
    lag_mm = (played.gap_mm - bare.gap_mm)[-3]
    assert lag_mm == pytest.approx(0.05 * 7.75, abs=GAP_MM)
    assert np.median(tables["edge_bias"].gap_mm - bare.gap_mm) == pytest.approx(0.06, abs=GAP_MM)
    drift = tables["camera_drift"]
    assert drift.midline_mm is not None
    assert drift.time_s is not None
    # The drift starts with the first motion of the stage; in the first rows the stage is at rest.
    moved = drift.time_s > 0.3
    assert np.polyfit(drift.time_s[moved], drift.midline_mm[moved], 1)[0] == pytest.approx(0.05, rel=0.02)
    assert np.median(drift.gap_mm - bare.gap_mm) == pytest.approx(0.0, abs=GAP_MM)


def test_a_run_that_follows_another_goes_on_on_its_clock(tmp_path: Path) -> None:
    recipe = recipe_at(tmp_path, steps('kind = "triangle"\nfrom_mm = 0.0\nto_mm = 0.3\nspeed_mm_s = 1.0'))
    first, second = tmp_path / "first", tmp_path / "second"
    drift = ["--hide", "camera_drift:rate_mm_per_s=0.05"]
    for out, more in ((first, []), (second, ["--after", str(first)])):
        done = CliRunner().invoke(cli, ["bed", "run", str(recipe), *drift, "--out", str(out), *more])
        assert done.exception is None, done.output
    assert "joined.csv --model" in done.output
    table = read_measured_table(second / "joined.csv")
    assert table.run_names == ("1", "2")
    assert table.shared_clock
    assert table.time_s is not None
    assert table.midline_mm is not None
    # The camera also drifted between the runs.
    moved = table.time_s > 0.3
    assert np.polyfit(table.time_s[moved], table.midline_mm[moved], 1)[0] == pytest.approx(0.05, rel=0.02)
    assert (first / "samples.csv").read_bytes() != (second / "samples.csv").read_bytes()


def test_a_reference_slot_shows_a_wrong_scale(tmp_path: Path) -> None:
    text = steps('kind = "reference_slot"\nsize_mm = 4.0\nu_size_mm = 0.002')
    assert run(tmp_path, text, Hidden({"scale_error": {"ratio": 0.02}})).counts.recorded == 0
    (found,) = json.loads((tmp_path / "run" / "run.json").read_text())["reference_slots"]
    assert found["ratio"] == pytest.approx(1.02, abs=2e-4)
