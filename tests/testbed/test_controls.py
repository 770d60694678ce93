"""Pause, continue and stop, by letters on a real terminal and by calls of the controls."""

import os
import pty
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from fingervision.domain.errors import StateError
from fingervision.storage.drive_csv import SampleRow, read_samples
from fingervision.storage.recipe_toml import read_recipe
from fingervision.storage.recorded_video import frames_in
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.camera import BedCamera, Shot
from fingervision.testbed.run.controls import Controls
from fingervision.testbed.run.recipe_run import run_recipe
from tests.testbed.simulated_beds import SHORT, recipe_at, run, steps

# Time limit for starting Python with its libraries on a loaded computer; no time is measured with it.
PATIENCE_S = 120.0
# This recipe is so long that it does not end before a letter is typed.
LONG = steps('kind = "hold"\nat_mm = 0.2\nseconds = 60.0')
SLOW = steps('kind = "move"\nto_mm = 0.8\nspeed_mm_s = 0.5')
SINE = steps('kind = "sine"\nmean_mm = 0.3\namplitude_mm = 0.2\nfrequency_hz = 0.5\ncycles = 1')
# The simulated bed with small pictures: what is held here is where the stage stands, and when.
SMALL = """schema = 1
[actuator]
kind = "simulated"
[camera]
kind = "simulated"
width_px = 320
height_px = 120
px_per_mm = 17.0
[gripper]
[scale]
px_per_mm = 17.0
[limits]
lower_mm = -0.46
upper_mm = 1.45
"""
# Frame during a slow move or a sine; the first frames are used to relate the clocks.
UNDER_WAY = 100
PAUSED_FRAMES = 20
ENCODER_STEP_MM = 0.03


class Pressing:
    """A camera that calls given functions before some of its frames."""

    def __init__(self, camera: BedCamera, at: dict[int, Callable[[], None]]) -> None:
        self.camera, self.at, self.count = camera, at, 0

    def __getattr__(self, name: str) -> object:
        return getattr(self.camera, name)

    def next(self) -> Shot:
        self.count += 1
        self.at.get(self.count, lambda: None)()
        return self.camera.next()


def pressed(
    folder: Path, text: str, at: dict[int, str], *, replays: bool, on_say: Callable[[Controls], None] = lambda _: None
) -> list[SampleRow]:
    """Run a recipe with letters typed before some of its frames, on a test bed that can replay or one treated as
    hardware.
    """
    (folder / "small.toml").write_text(SMALL, encoding="utf-8")
    bed, controls = open_bed(str(folder / "small.toml")), Controls()
    assert bed.camera is not None
    camera = Pressing(bed.camera, {k: lambda keys=keys: list(map(controls._letter, keys)) for k, keys in at.items()})  # type: ignore[misc]
    bed = replace(bed, camera=camera, replays=replays)  # type: ignore[arg-type]
    recipe = read_recipe(recipe_at(folder, text))
    run_recipe(recipe, bed, folder / "run", controls=controls, say=lambda words: on_say(controls))
    return read_samples(folder / "run" / "samples.csv")


def test_a_pause_stops_the_motor_and_the_motion_goes_on_after_it(tmp_path: Path) -> None:
    rows = pressed(tmp_path, SLOW, {UNDER_WAY: "p", UNDER_WAY + PAUSED_FRAMES: "p"}, replays=False)
    encoder = np.array([row.encoder_mm for row in rows])
    inside = (encoder > 0.1) & (encoder < 0.7)
    stood_mm, frames = np.unique(encoder[inside], return_counts=True)
    # The stage rested during the pause; otherwise it passes each step of the encoder within two frames.
    assert frames.max() >= PAUSED_FRAMES
    assert np.sort(frames)[-2] <= 3
    assert encoder[-1] == pytest.approx(0.8, abs=0.09 + ENCODER_STEP_MM)
    assert np.all(np.diff(encoder) >= 0.0)
    assert stood_mm.size > 10


def test_a_pause_that_is_over_before_the_next_frame_breaks_no_motion_off(tmp_path: Path) -> None:
    rows = pressed(tmp_path, SLOW, {UNDER_WAY: "pp"}, replays=False)
    assert rows[-1].encoder_mm == pytest.approx(0.8, abs=0.09 + ENCODER_STEP_MM)


def test_a_sine_goes_on_where_it_was_paused(tmp_path: Path) -> None:
    rows = pressed(tmp_path, SINE, {UNDER_WAY: "p", UNDER_WAY + 3 * PAUSED_FRAMES: "p"}, replays=False)
    encoder = np.array([row.encoder_mm for row in rows])
    # Frames are 40 ms apart, at 0.63 mm/s; a piece of the sine of three frames is continued at its initial speed.
    assert np.max(np.abs(np.diff(encoder))) <= 3 * 0.04 * 0.63 + 2 * ENCODER_STEP_MM
    assert encoder.max() == pytest.approx(0.5, abs=0.09 + ENCODER_STEP_MM)
    assert encoder.min() == pytest.approx(0.0, abs=0.09 + ENCODER_STEP_MM)
    assert encoder[-1] == pytest.approx(0.3, abs=0.09 + ENCODER_STEP_MM)


def test_a_hold_lasts_its_time_beside_a_pause(tmp_path: Path) -> None:
    hold = steps('kind = "hold"\nat_mm = 0.0\nseconds = 1.0')
    rows = pressed(tmp_path, hold, {90: "p", 90 + 2 * PAUSED_FRAMES: "p"}, replays=False)
    # Frames during the pause are recorded as well.
    assert rows[-1].time_s == pytest.approx(1.0 + 2 * PAUSED_FRAMES * 0.04, abs=0.3)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("whole")
    run(folder)
    return (folder / "run" / "samples.csv").read_bytes()


@pytest.mark.slow
def test_the_time_of_a_simulation_stands_while_it_is_paused(tmp_path: Path, whole: bytes) -> None:
    pauses = dict.fromkeys((80, 88, 100, 120), "p")
    pressed(tmp_path, SHORT, pauses, replays=True, on_say=Controls.toggle_pause)
    assert (tmp_path / "run" / "samples.csv").read_bytes() == whole


# At these frames, rows are held back, because later readings determine the position of the stage better.
@pytest.mark.slow
@pytest.mark.parametrize("at", [81, 91])
def test_a_stopped_simulation_goes_on_to_the_same_end(tmp_path: Path, whole: bytes, at: int) -> None:
    with pytest.raises(StateError):
        pressed(tmp_path, SHORT, {at: "q"}, replays=True)
    run(tmp_path)
    assert (tmp_path / "run" / "samples.csv").read_bytes() == whole


def test_a_stop_ends_a_pause(tmp_path: Path) -> None:
    for replays in (True, False):
        with pytest.raises(
            StateError, match=r"^The run was stopped, and the motor is at rest\. The same command continues the run"
        ):
            pressed(tmp_path, SLOW, {UNDER_WAY: "p"}, replays=replays, on_say=Controls.stop)


@pytest.mark.parametrize("replays", [True, False])
def test_a_stop_before_a_motion_lets_nothing_move(tmp_path: Path, replays: bool) -> None:
    bed, controls = replace(open_bed("simulated"), replays=replays), Controls()
    moves: list[float] = []

    class Counting:
        def __getattr__(self, name: str) -> object:
            return getattr(bed.actuator, name)

        def move(self, to_mm: float, speed_mm_s: float) -> None:
            moves.append(to_mm)

    controls.toggle_pause()
    counted = replace(bed, actuator=Counting())  # type: ignore[arg-type]
    recipe = read_recipe(recipe_at(tmp_path, SLOW))
    with pytest.raises(StateError):
        run_recipe(recipe, counted, tmp_path / "run", controls=controls, say=lambda words: stop_at(words, controls))
    assert moves == []


def stop_at(words: str, controls: Controls) -> None:
    if "paused" in words:
        controls.stop()


@pytest.fixture
def typed(tmp_path: Path) -> Iterator[tuple[int, "subprocess.Popen[str]"]]:
    """The typing end of a terminal, and a run at its other end."""
    typing, reading = pty.openpty()
    words = [sys.executable, "-m", "fingervision", "bed", "run", str(recipe_at(tmp_path, LONG)), "--real-time"]
    with (tmp_path / "said").open("w") as said:
        process = subprocess.Popen([*words, "--out", str(tmp_path / "run")], stdin=reading, stderr=said, text=True)
    os.close(reading)
    yield typing, process
    process.kill()
    process.wait()
    os.close(typing)


@pytest.mark.slow
def test_letters_on_a_terminal_pause_go_on_and_stop(tmp_path: Path, typed: tuple[int, "subprocess.Popen[str]"]) -> None:
    typing, process = typed
    video = tmp_path / "run" / "video.mp4"

    def said() -> str:
        return (tmp_path / "said").read_text()

    def wait_until(holds: Callable[[], bool]) -> None:
        until_s = monotonic() + PATIENCE_S
        while not holds():
            assert monotonic() < until_s, said()
            assert process.poll() is None, said()
            sleep(0.05)

    os.write(typing, b"p\n")
    wait_until(lambda: "The run is paused: type p and Enter to continue it, or q and Enter to end it." in said())
    frames = frames_in(video)
    sleep(0.5)
    assert frames_in(video) == frames
    os.write(typing, b"p\n")
    wait_until(lambda: frames_in(video) > frames + 10)
    os.write(typing, b"q\n")
    assert process.wait(PATIENCE_S) == 1
    assert (
        said()
        .splitlines()[-1]
        .endswith("The run was stopped, and the motor is at rest. The same command continues the run.")
    )
    assert "Traceback" not in said()
