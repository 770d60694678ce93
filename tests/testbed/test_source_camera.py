"""A camera that runs continuously: its frames may be outdated, and a run with it resumes with the interrupted leg."""

from pathlib import Path

import pytest

from fingervision.domain.errors import DeviceError, InputFileError
from fingervision.storage.drive_csv import read_samples
from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import run_recipe
from tests.testbed.simulated_beds import live_camera_at, recipe_at, run, steps

TWO_MOVES = steps(
    'kind = "move"\nto_mm = 0.3\nspeed_mm_s = 2.0\nframes = 2',
    'kind = "move"\nto_mm = 0.5\nspeed_mm_s = 2.0\nframes = 2',
)


class BreaksOffError(Exception):
    """Exception that ends a run between two legs."""


def break_off(done: float, total: float) -> None:
    raise BreaksOffError


@pytest.mark.slow
def test_a_run_that_cannot_be_played_again_goes_on_with_its_leg_as_another_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The gripper of this camera moves all the time.
    monkeypatch.setattr("fingervision.testbed.run.step_executor.STILL_WITHIN_S", 0.5)
    config = live_camera_at(tmp_path)
    bed = open_bed(str(config))
    with pytest.raises(BreaksOffError):
        run_recipe(read_recipe(recipe_at(tmp_path, TWO_MOVES)), bed, tmp_path / "run", on_progress=break_off)
    bed.close()
    before = read_samples(tmp_path / "run" / "samples.csv")
    assert [row.run for row in before] == ["1", "1"]
    assert run(tmp_path, TWO_MOVES, bed_name=str(config)).resumed_after == 2
    rows = read_samples(tmp_path / "run" / "samples.csv")
    assert rows[:2] == before
    # The first leg had ended, but its end is only recorded when the next leg begins: the first leg is repeated.
    assert [(row.run, row.step) for row in rows[2:]] == [("2", 1), ("2", 1), ("2", 2), ("2", 2)]
    times = [row.time_s for row in rows]
    assert times == sorted(times)
    assert times[2] - times[1] >= 1.0


def test_a_camera_that_ends_is_said_and_the_motor_stands(tmp_path: Path) -> None:
    bed = open_bed(str(live_camera_at(tmp_path)))
    assert bed.camera is not None
    bed.camera.close()
    with pytest.raises(DeviceError, match="must send frames while the test bed works, but it ended: the motor was"):
        run_recipe(read_recipe(recipe_at(tmp_path, TWO_MOVES)), bed, tmp_path / "run")
    assert not bed.actuator.busy


def test_a_recording_is_no_camera(tmp_path: Path) -> None:
    config = live_camera_at(tmp_path)
    config.write_text(config.read_text().replace('source = "simulated"', 'source = "away.mp4"'))
    with pytest.raises(InputFileError, match=r"away\.mp4"):
        open_bed(str(config))
