"""A run on the simulated test bed: the table is correct, its video gives the same values, and the results are
repeatable.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.domain.numbers import with_uncertainty
from fingervision.storage.drive_csv import read_samples
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.simulation_table import read_simulation_table
from fingervision.testbed.simulation.injected_effects import Hidden
from tests.commands import printed
from tests.csv_rows import csv_rows
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


def test_the_frames_of_the_check_are_those_of_the_run(short: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(cli, ["bed", "check", str(recipe_at(tmp_path)), "--json"])
    planned, recorded = json.loads(done.stdout), len(read_samples(short / "samples.csv"))
    assert planned["frames"] <= recorded <= planned["frames_at_most"] <= 1.1 * recorded


def test_measuring_the_video_again_gives_the_table(short: Path, tmp_path: Path) -> None:
    assert_table_is_that_of_its_video(short, tmp_path)


def test_the_table_is_measured_by_the_camera_that_measuring_the_video_learns(tmp_path: Path) -> None:
    camera = Path(__file__).with_name("toned_camera.py").as_posix()
    bed = tmp_path / "bed.toml"
    bed.write_text(
        f'schema = 1\n[actuator]\nkind = "simulated"\n[camera]\nkind = "{camera}"\n[gripper]\n'
        "[scale]\npx_per_mm = 34.0\n[limits]\nlower_mm = -0.46\nupper_mm = 1.45\ngap_mm = 0.05\n",
        encoding="utf-8",
    )
    run(tmp_path, steps('kind = "triangle"\nfrom_mm = -0.2\nto_mm = 0.6\nspeed_mm_s = 0.5'), bed_name=str(bed))
    assert_table_is_that_of_its_video(tmp_path / "run", tmp_path / "measured")
    table = read_measured_table(tmp_path / "run" / "samples.csv")
    model = read_simulation_table(tmp_path / "run" / "simulation.csv")
    assert np.max(np.abs(table.gap_mm - model.respond(table.input_mm).gap_mm)) < GAP_MM


def assert_table_is_that_of_its_video(folder: Path, out: Path) -> None:
    rows = read_samples(folder / "samples.csv")
    command = ["measure", str(folder / "video.mp4"), "--px-per-mm", "34", "--below-tip-mm", "0.3", "--out", str(out)]
    assert CliRunner().invoke(cli, command).exit_code == 0
    measured = csv_rows(out / "gaps.csv")
    assert len(measured) == len(rows) > 50
    for row, again in zip(rows, measured, strict=True):
        assert row.status == again["status"]
        assert row.time_s == pytest.approx(float(again["time_s"]), abs=1e-6)
        for name in ("gap_mm", "u_random_mm", "left_mm", "right_mm"):
            assert getattr(row, name) == pytest.approx(float(again[name]), abs=1e-7), name


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
        done = printed("bed", "run", str(recipe), *drift, "--out", str(out), *more)
    assert "joined.csv --model" in done
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
