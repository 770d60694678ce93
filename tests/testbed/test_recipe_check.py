"""`bed check`: the plan agrees with the run, every refusal is reported, and no hardware is used."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from fingervision.cli import cli
from fingervision.domain.errors import DataError, FingervisionError
from fingervision.storage.drive_csv import read_samples
from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.run.plan import plan
from fingervision.testbed.run.recipe_check import planned_bed
from tests.commands import printed
from tests.testbed.board_bed import CONTRACT_STEPS, written_bed

HEAD = 'schema = 1\nname = "test"\nbelow_force_n = 2.9\n'
# The triangle covers less than half of the stroke, so that the force stays below the limit of the recipe.
TRIANGLE = '[[step]]\nkind = "triangle"\nfrom_mm = -0.2\nto_mm = {to_mm}\nspeed_mm_s = {speed}\ncycles = 1\n'
# Relative excess of a run over its plan: settling of the picture, frames before a reversal, the last step of the
# encoder.
BESIDE_THE_PLAN = 0.25


def check(folder: Path, steps: str, *options: str) -> Result:
    (folder / "recipe.toml").write_text(HEAD + steps, encoding="utf-8")
    return CliRunner().invoke(cli, ["bed", "check", str(folder / "recipe.toml"), *options], catch_exceptions=True)


@pytest.mark.slow
def test_a_run_takes_the_time_and_the_way_of_its_plan(tmp_path: Path) -> None:
    steps = TRIANGLE.format(to_mm=1.0, speed=0.5) + '[[step]]\nkind = "hold"\nat_mm = 0.4\nseconds = 2.0\n'
    planned = json.loads(check(tmp_path, steps, "--json").stdout)
    out = str(tmp_path / "run")
    printed("bed", "run", str(tmp_path / "recipe.toml"), "--out", out)
    rows = read_samples(tmp_path / "run" / "samples.csv")
    assert rows[-1].time_s - rows[0].time_s == pytest.approx(planned["seconds"], rel=BESIDE_THE_PLAN)
    inputs = [row.input_mm for row in rows if row.input_mm is not None]
    # The simulated stage stops within 90 um of its target.
    assert min(inputs) == pytest.approx(min(step["lower_mm"] for step in planned["steps"]), abs=0.1)
    assert max(inputs) == pytest.approx(max(step["upper_mm"] for step in planned["steps"]), abs=0.1)
    gaps = [row.gap_mm for row in rows if row.gap_mm is not None]
    low, high = (end(step["gap_mm"][k] for step in planned["steps"]) for k, end in ((0, min), (1, max)))
    assert low - 0.8 < min(gaps) < max(gaps) < high + 0.8


def test_every_step_that_does_not_fit_is_said_with_its_line(tmp_path: Path) -> None:
    steps = (
        TRIANGLE.format(to_mm=1.0, speed=0.5)
        + TRIANGLE.format(to_mm=9.0, speed=0.5)
        + TRIANGLE.format(to_mm=1.0, speed=900.0)
        + '[[step]]\nkind = "close_until_contact"\nspeed_mm_s = 0.1\nbelow_force_n = 1.0\n'
    )
    done = check(tmp_path, steps, "--json")
    assert done.exit_code == 1
    planned = json.loads(done.stdout)
    assert planned["fits"] is False
    refused = {step["number"]: step["refusal"] for step in planned["steps"] if step["refusal"]}
    assert sorted(refused) == [2, 3]
    assert "9" in refused[2]
    assert "line 13" in refused[2]
    assert "900" in refused[3]
    for step in planned["steps"]:
        # A step that is refused has no gap.
        assert (step["gap_mm"] is None) == (step["refusal"] is not None)


def test_a_bed_with_a_board_is_checked_without_its_board(tmp_path: Path) -> None:
    bed = written_bed(tmp_path, "/dev/there-is-no-such-port", CONTRACT_STEPS, lower_mm=-1.0)
    move = '[[step]]\nkind = "move"\nto_mm = {}\nspeed_mm_s = 2.0\n'
    assert check(tmp_path, move.format(0.5), "--bed", str(bed)).exit_code == 0
    nowhere = check(tmp_path, move.format(0.31), "--bed", str(bed))
    assert nowhere.exit_code == 1
    assert "0.31" in str(nowhere.exception)


@pytest.mark.parametrize(
    ("steps", "names"),
    [
        ('[[step]]\nkind = "wave"\n', "wave"),
        ('[[step]]\nkind = "move"\nto_mm = nan\nspeed_mm_s = 1\n', "to_mm"),
        ('[[step]]\nkind = "move"\nto_mm = 1\nspeed_mm_s = -1\n', "speed_mm_s"),
        ('[[step]]\nkind = "move"\nto_mm = 1\nspeed_mm_s = 1\nframe = 3\n', "frame"),
        ('[[step]]\nkind = "hold"\nat_mm = 0.2\nseconds = 1e300\n', "seconds"),
        ('[[step]]\nkind = "triangle"\nfrom_mm = 1\nto_mm = 1\nspeed_mm_s = 1\n', "to_mm"),
        ("", "step"),
        ("[[step]", "TOML"),
    ],
)
def test_a_recipe_that_makes_no_sense_is_one_sentence(tmp_path: Path, steps: str, names: str) -> None:
    done = check(tmp_path, steps)
    assert done.exit_code == 1, done.output
    assert names in str(done.exception)
    assert isinstance(done.exception, FingervisionError)


def test_a_bed_without_a_file_is_one_sentence(tmp_path: Path) -> None:
    done = check(tmp_path, TRIANGLE.format(to_mm=1.0, speed=0.5), "--bed", str(tmp_path / "no.toml"))
    assert done.exit_code == 1
    assert "no.toml" in str(done.exception)


def test_a_simulated_bed_that_is_opened_again_has_the_model_that_was_built(tmp_path: Path) -> None:
    first, second = (planned_bed("simulated"), planned_bed("simulated"))
    assert first.model is second.model
    thicker = tmp_path / "gripper.toml"
    text = (Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml").read_text(encoding="utf-8")
    thicker.write_text(text.replace("thickness_mm = 1.0", "thickness_mm = 1.1"), encoding="utf-8")
    bed = '[actuator]\nkind = "simulated"\n[camera]\nkind = "simulated"\n[gripper]\nfile = "gripper.toml"\n'
    (tmp_path / "bed.toml").write_text(f"schema = 1\n{bed}[scale]\npx_per_mm = 34.0\n", encoding="utf-8")
    other = planned_bed(str(tmp_path / "bed.toml"))
    assert other.model is not None
    assert first.model is not None
    assert other.model.respond(np.ones(1)).force_n > first.model.respond(np.ones(1)).force_n


def test_a_recipe_with_a_screw_turned_by_hand_is_checked(tmp_path: Path) -> None:
    (tmp_path / "bed.toml").write_text('schema = 1\n[actuator]\nkind = "hand_screw"\nlower_mm = -1\nupper_mm = 2\n')
    done = check(tmp_path, TRIANGLE.format(to_mm=1.0, speed=0.5), "--bed", str(tmp_path / "bed.toml"))
    assert done.exit_code == 0, done.output
    assert "inf" not in done.output


def test_a_force_limit_that_a_recipe_does_not_state_is_that_of_the_bed(tmp_path: Path) -> None:
    step, weak = '[[step]]\nkind = "move"\nto_mm = 0.1\nspeed_mm_s = 1.0\n', SoftLimits(-1.0, 1.0, force_n=2.0)
    path = tmp_path / "recipe.toml"
    path.write_text(f"schema = 1\n{step}", encoding="utf-8")
    assert plan(read_recipe(path), weak, None, 0.0, 25.0, 10.0)
    path.write_text(f"schema = 1\nbelow_force_n = 3.0\n{step}", encoding="utf-8")
    with pytest.raises(DataError, match=r"below_force_n in line 2 .* limit of force, 2 N"):
        plan(read_recipe(path), weak, None, 0.0, 25.0, 10.0)
