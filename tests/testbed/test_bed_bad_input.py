"""A request that cannot be run is refused with one sentence, and nothing moves."""

import json
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from fingervision.demonstration.demonstrate import demonstrate
from fingervision.domain.errors import DataError, DeviceError, FingervisionError, LimitError, OutputError
from fingervision.storage.out_folder import FolderLock
from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.actuator import Actuator, Alarm
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.simulation.injected_effects import Hidden
from tests.testbed.simulated_beds import recipe_at, run, steps

MOVE = 'kind = "move"\nto_mm = 0.3\nspeed_mm_s = 1.0'
BED = """schema = 1
[actuator]
kind = "simulated"
[camera]
kind = "simulated"
{camera}
[gripper]
[scale]
px_per_mm = 34.0
[limits]
lower_mm = -0.4
upper_mm = 1.4
gap_mm = {gap_mm}
"""


@pytest.mark.parametrize(
    ("step", "sentence"),
    [
        (
            'kind = "triangle"\nfrom_mm = -0.3\nto_mm = 1.9\nspeed_mm_s = 0.5',
            "to_mm in line 6 of {path} leads beyond the test bed's limit of position, 1.45 mm: it needs 1.9, which is "
            "0.45 mm too much. Nothing was moved.",
        ),
        (
            'kind = "move"\nto_mm = -0.5\nspeed_mm_s = 0.5',
            "to_mm in line 5 of {path} leads below the test bed's limit of position, -0.46 mm: it needs -0.5, which is "
            "0.04 mm too little. Nothing was moved.",
        ),
        (
            'kind = "move"\nto_mm = 0.9\nspeed_mm_s = 500',
            "speed_mm_s in line 6 of {path} leads beyond the test bed's limit of speed, 400 mm/s: it needs 500, which "
            "is 100 mm/s too much. Nothing was moved.",
        ),
        (
            'kind = "sine"\nmean_mm = 1.2\namplitude_mm = 0.5\nfrequency_hz = 0.1',
            "amplitude_mm in line 6 of {path} leads beyond the test bed's limit of position, 1.45 mm: it needs 1.7, "
            "which is 0.25 mm too much. Nothing was moved.",
        ),
        (
            'kind = "close_until_contact"\nspeed_mm_s = 1.0\nbelow_force_n = 7.0',
            "below_force_n in line 6 of {path} leads beyond the test bed's limit of force, 5 N: it needs 7, which is "
            "2 N too much. Nothing was moved.",
        ),
        (
            'kind = "moove"\nto_mm = 1',
            "kind in line 4 of {path} must be one of {kinds}, but is 'moove': did you mean move?",
        ),
        (
            'kind = "move"\ntoo_mm = 1.0\nspeed_mm_s = 1.0',
            "too_mm in line 5 of {path} is not known: did you mean to_mm?",
        ),
        ('kind = "move"\nspeed_mm_s = 1.0', "[step] in line 3 of {path} must state to_mm, but does not: add it."),
        (
            'kind = "move"\nto_mm = "far"\nspeed_mm_s = 1.0',
            "to_mm in line 5 of {path} must be a number, but is 'far'.",
        ),
        (
            'kind = "move"\nto_mm = 0.2\nspeed_mm_s = 0',
            "speed_mm_s in line 6 of {path} must be greater than 0 mm/s, but is 0.",
        ),
        (
            'kind = "reference_slot"\nsize_mm = 40.0',
            "size_mm in line 5 of {path} must be less than the 18.8 mm that the camera sees, but is 40.",
        ),
        (
            'kind = "hold"\nat_mm = 0.2\nseconds = 1\nframes = "many"',
            "frames in line 7 of {path} must be \"continuous\" or a number of frames for each point, but is 'many'.",
        ),
    ],
)
def test_a_recipe_that_cannot_be_run_is_said_with_its_line(tmp_path: Path, step: str, sentence: str) -> None:
    kinds = "close_until_contact, hold, move, reference_slot, rezero, shift_picture, sine, staircase, triangle"
    with pytest.raises(DataError) as caught:
        run(tmp_path, steps(step))
    path = tmp_path / "recipe.toml"
    assert str(caught.value) == sentence.format(path=path, kinds=f"{kinds}, turn_part_180")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("table", ["[bussy]", "[[bussy]]", "[ bussy ]", "[bussy.here]"])
def test_an_unknown_table_is_said_with_its_line(table: str, tmp_path: Path) -> None:
    path = tmp_path / "bed.toml"
    path.write_text(f'schema = 1\n[actuator]\nkind = "simulated"\n\n{table}\nsay = "?"\n', encoding="utf-8")
    with pytest.raises(DataError, match="bussy in line 5 of "):
        open_bed(str(path))


def test_a_force_that_the_gripper_would_need_is_foreseen(tmp_path: Path) -> None:
    text = 'schema = 1\nbelow_force_n = 1.0\n[[step]]\nkind = "move"\nto_mm = 1.2\nspeed_mm_s = 1.0\n'
    with pytest.raises(DataError, match=r"to_mm in line 5 .* limit of force at 1\.2 mm, 1 N: it needs 2\.46"):
        run(tmp_path, text)


def test_a_sine_needs_an_actuator_that_goes_anywhere(tmp_path: Path) -> None:
    class Stepping:
        has_steps = True

        def __init__(self, actuator: Actuator) -> None:
            self.actuator = actuator

        def __getattr__(self, name: str) -> object:
            return getattr(self.actuator, name)

    bed = open_bed("simulated")
    bed = replace(bed, actuator=Stepping(bed.actuator))  # type: ignore[arg-type]
    sine = 'kind = "sine"\nmean_mm = 0.2\namplitude_mm = 0.1\nfrequency_hz = 0.1'
    recipe = recipe_at(tmp_path, steps(sine))
    with pytest.raises(LimitError) as raised:
        run_recipe(read_recipe(recipe), bed, tmp_path / "run")
    assert str(raised.value) == (
        f"kind in line 4 of {recipe} cannot be executed: a sine consists of many short moves to intermediate positions"
        ", but this actuator can only move to the target positions of its step data. Use a triangle or a staircase "
        "between two target positions of the step data. Nothing was moved."
    )
    assert not (tmp_path / "run").exists()


def test_a_camera_that_sees_no_fingers_lets_nothing_move(tmp_path: Path) -> None:
    config = tmp_path / "blind.toml"
    config.write_text(BED.format(camera="off_centre_mm = 30.0", gap_mm=0.0))
    bed = open_bed(str(config))
    with pytest.raises(DeviceError, match="The camera must show both fingers before anything moves, but does not"):
        run_recipe(read_recipe(recipe_at(tmp_path, steps(MOVE))), bed, tmp_path / "run")
    assert bed.actuator.readings()[-1].value == 0.0
    # Nothing was recorded, so that the same folder can be used after the view was corrected.
    config.write_text(BED.format(camera="", gap_mm=0.0))
    assert run(tmp_path, steps(MOVE), bed_name=str(config)).resumed_after == 0


def test_a_stage_of_unknown_place_is_not_homed_before_the_fingers_were_seen(tmp_path: Path) -> None:
    class Unhomed:
        def __init__(self, actuator: Actuator) -> None:
            self.actuator, self.homed = actuator, False

        def __getattr__(self, name: str) -> object:
            return getattr(self.actuator, name)

        def home(self) -> None:
            self.homed = True
            self.actuator.home()

    for camera, homed in (("off_centre_mm = 30.0", False), ("", True)):
        config = tmp_path / "bed.toml"
        config.write_text(BED.format(camera=camera, gap_mm=0.0))
        bed = open_bed(str(config))
        actuator = Unhomed(bed.actuator)
        real = replace(bed, replays=False, actuator=actuator)  # type: ignore[arg-type]
        with suppress(FingervisionError):
            run_recipe(read_recipe(recipe_at(tmp_path, steps(MOVE))), real, tmp_path / f"run-{homed}")
        assert actuator.homed == homed


def test_a_gap_below_the_limit_stops_the_motor(tmp_path: Path) -> None:
    config = tmp_path / "narrow.toml"
    # According to the drawing, the gap stays above the limit; the plan does not include added effects.
    config.write_text(BED.format(camera="", gap_mm=2.0))
    text = steps('kind = "move"\nto_mm = -0.25\nspeed_mm_s = 0.5')
    hidden = Hidden({"rest_gap_error": {"offset_mm": -0.5}})
    with pytest.raises(LimitError, match=r"The gap must stay above 2 mm, but is 1\.9\d+ mm at .*was stopped"):
        run(tmp_path, text, hidden, str(config))


def test_an_alarm_stops_the_run_and_is_said(tmp_path: Path) -> None:
    class Failing(NamedTuple):
        bed: Bed

        def say_when(self, done: float, total: float) -> None:
            self.bed.actuator.raise_alarm(Alarm("E7", "overload"))  # type: ignore[attr-defined]

    bed = open_bed("simulated")
    recipe = read_recipe(recipe_at(tmp_path))
    with pytest.raises(DeviceError, match=r"The actuator .* alarm.* E7 \(overload\)"):
        run_recipe(recipe, bed, tmp_path / "run", on_progress=Failing(bed).say_when)
    assert not bed.actuator.busy
    assert json.loads((tmp_path / "run" / "run.json").read_text())["complete"] is False


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.tex").write_text("mine")
    with pytest.raises(OutputError, match=r"must be a new or empty folder, but .* contains thesis\.tex"):
        run(tmp_path, steps(MOVE))
    assert (tmp_path / "run" / "thesis.tex").read_text() == "mine"


def test_a_demonstration_leaves_other_files_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    for out, sentence in (
        (tmp_path, f"--out must be a new or empty folder, but {tmp_path} contains thesis.tex: name another folder."),
        (tmp_path / "thesis.tex", f"--out must be a folder, but {tmp_path / 'thesis.tex'} is a file: name another."),
    ):
        with pytest.raises(OutputError) as raised:
            demonstrate(Hidden(), 1, out, lambda words: None)
        assert str(raised.value) == sentence
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_finished_run_is_left_alone(tmp_path: Path) -> None:
    run(tmp_path, steps(MOVE))
    table = (tmp_path / "run" / "samples.csv").read_bytes()
    with pytest.raises(OutputError, match=r"is finished already: name another folder"):
        run(tmp_path, steps(MOVE))
    assert (tmp_path / "run" / "samples.csv").read_bytes() == table


def test_two_programs_on_one_folder(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    lock = FolderLock(tmp_path / "run")
    with pytest.raises(OutputError, match="is in use by another run: wait for its end"):
        run(tmp_path, steps(MOVE))
    lock.release()
    run(tmp_path, steps(MOVE))


def test_a_full_disk_is_seen_before_anything_moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda path: type("Usage", (), {"free": 1000})())
    with pytest.raises(
        OutputError, match=r"needs up to \d+ MB, but .* has 0 MB free: free disk space.*Nothing was moved"
    ):
        run(tmp_path, steps(MOVE))


@pytest.mark.slow
def test_a_disk_that_fills_up_ends_the_run_in_a_sentence(tmp_path: Path) -> None:
    recipe = recipe_at(tmp_path)
    program = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000));"
        "import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "from fingervision.cli import main; sys.argv = ['fv', 'bed', 'run', sys.argv[1], '--out', sys.argv[2]]; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(recipe), str(tmp_path / "run")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "could not be written any further" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("schema = 1\n", "must have an [actuator], but has none: add it with its kind."),
        ('schema = 1\n[actuator]\nkind = "simulated"\nspeed = 1\n', "speed in line 4 of {path} is not known"),
        ("schema = 9\n", "schema in line 1 of {path} must be at most 1, but is 9: use a newer fingervision."),
        ("schema = \n", "{path} must be TOML, but is not"),
        (
            'schema = 1\n[actuator]\nkind = "simulated"\n[camera]\nkind = "simulated"\n',
            "A simulated camera (line 5 of {path}) must have a simulated gripper, but the test bed has none",
        ),
    ],
)
def test_a_bed_that_makes_no_sense_is_said(tmp_path: Path, text: str, sentence: str) -> None:
    config = tmp_path / "bed.toml"
    config.write_text(text)
    with pytest.raises(DataError) as caught:
        open_bed(str(config))
    assert sentence.format(path=config) in str(caught.value)


def test_a_bed_without_a_camera_or_a_scale_is_said(tmp_path: Path) -> None:
    config = tmp_path / "bed.toml"
    config.write_text('schema = 1\n[actuator]\nkind = "simulated"\n')
    with pytest.raises(DataError, match=r"A run needs a camera, but the test bed has none: add a \[camera\]"):
        run(tmp_path, steps(MOVE), bed_name=str(config))
