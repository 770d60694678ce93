"""Frames that the camera should have sent by its rate, and that never reached the record, are counted and said."""

import json
from pathlib import Path
from time import sleep
from typing import Any

import pytest

from fingervision.storage.drive_csv import read_samples
from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.run.synchronised_acquisition import Sight
from tests.testbed.simulated_beds import live_camera_at, recipe_at, run, steps

CONTINUOUS = (
    'kind = "triangle"\nfrom_mm = -0.2\nto_mm = 0.4\nspeed_mm_s = 1.0',
    'kind = "hold"\nat_mm = -0.2\nseconds = 1.0',
)
POINTS = 'kind = "staircase"\nfrom_mm = -0.2\nto_mm = 0.2\nsteps = 2\nspeed_mm_s = 1.0\nframes = 3'
RECIPE = steps(*CONTINUOUS, POINTS, 'kind = "rezero"', CONTINUOUS[0])


@pytest.fixture(autouse=True)
def few_first_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fingervision.testbed.run.recipe_run.FIRST_FRAMES", 10)


class BreaksOffError(Exception):
    """Exception that ends a run between two legs."""


def lossy_bed(folder: Path, rate: str = "rate_hz = 25.0") -> str:
    camera, path = Path(__file__).with_name("lossy_camera.py").as_posix(), folder / "bed.toml"
    path.write_text(
        f'schema = 1\n[actuator]\nkind = "simulated"\n[camera]\nkind = "{camera}"\n{rate}\n[gripper]\n'
        "[scale]\npx_per_mm = 34.0\n[limits]\nlower_mm = -0.46\nupper_mm = 1.45\n",
        encoding="utf-8",
    )
    return str(path)


def test_frames_that_never_came_are_counted_and_said(tmp_path: Path) -> None:
    said: list[str] = []
    run(tmp_path, RECIPE, bed_name=lossy_bed(tmp_path), say=said.append)
    about = json.loads((tmp_path / "run" / "run.json").read_text())
    rows = read_samples(tmp_path / "run" / "samples.csv")
    assert len([row for row in rows if row.step == 3]) == 9
    # Each frame of a continuous step follows two that are lost, but for the first one of each of both runs.
    continuous = [row for row in rows if row.step in (1, 2, 5)]
    assert about["frames_lost"] == 2 * len(continuous)
    assert any(words.startswith(f"warning: {about['frames_lost']} frames are lost") for words in said)
    assert '"frames_lost"' in (tmp_path / "run" / "events.jsonl").read_text()


def test_frames_that_a_busy_computer_does_not_take_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The camera keeps eight frames, and each is measured more slowly than they come."""
    measure = Sight.measure

    def slowly(*given: Any) -> Any:
        sleep(0.1)
        return measure(*given)

    monkeypatch.setattr(Sight, "measure", slowly)
    path, camera = live_camera_at(tmp_path), Path(__file__).with_name("steady_camera.py").as_posix()
    before, _, after = path.read_text().partition("[camera]")
    path.write_text(f'{before}[camera]\nkind = "{camera}"\n{after[after.index("[scale]") :]}')
    counts = run(tmp_path, steps(CONTINUOUS[0]), bed_name=str(path)).counts
    rows = read_samples(tmp_path / "run" / "samples.csv")
    expected = 25.0 * (rows[-1].time_s - rows[0].time_s)
    assert counts.lost > 0.5 * expected
    assert counts.recorded + counts.lost == pytest.approx(expected, abs=0.05 * expected + 6)
    # The last frame shows the stage after its motion, within its accuracy.
    assert rows[-1].input_mm == pytest.approx(-0.2, abs=0.09)


def test_a_complete_run_has_lost_none(tmp_path: Path) -> None:
    said: list[str] = []
    assert run(tmp_path, RECIPE, say=said.append).counts.lost == 0
    assert not any("lost" in words for words in said)


def test_a_run_that_goes_on_counts_the_frames_lost_before(tmp_path: Path) -> None:
    def break_off(done: float, total: float) -> None:
        if done > 0.6 * total:
            raise BreaksOffError

    bed = open_bed(lossy_bed(tmp_path))
    with pytest.raises(BreaksOffError):
        run_recipe(read_recipe(recipe_at(tmp_path, RECIPE)), bed, tmp_path / "run", on_progress=break_off)
    bed.close()
    went_on = run(tmp_path, RECIPE, bed_name=lossy_bed(tmp_path))
    assert went_on.resumed_after > 0
    (tmp_path / "whole").mkdir()
    assert went_on.counts == run(tmp_path / "whole", RECIPE, bed_name=lossy_bed(tmp_path)).counts
