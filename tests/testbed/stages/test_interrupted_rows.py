"""Every row states where the stage truly was: where it starts and arrives, and the last ones before an interruption."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from fingervision.domain.errors import StateError
from fingervision.storage.drive_csv import SampleRow, read_samples
from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.controls import Controls
from fingervision.testbed.run.recipe_run import run_recipe
from tests.testbed.simulated_beds import recipe_at, steps
from tests.testbed.stages.emulators import EmulatorsClock, Grbl, Plant, virtual_time
from tests.testbed.stages.stage_cases import CAMERA, CASES

pytestmark = pytest.mark.filterwarnings("ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning")
RATE_HZ = 25.0
# The controller states its position to 0.1 um, and the camera's clock is known to a part of a millisecond.
KNOWN_WITHIN_MM = 5e-4


class InterruptingClock(EmulatorsClock):
    """Lets a stop come at a time at which the test bed waits for a frame."""

    controls: Controls | None = None
    at_s = float("inf")

    def wait_until(self, time_s: float) -> None:
        if self.controls is not None and self.at_s < time_s:
            super().wait_until(self.at_s)
            controls, self.controls = self.controls, None
            controls.stop()
        super().wait_until(time_s)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> InterruptingClock:
    clock = InterruptingClock(begin_s=100.0)
    monkeypatch.setattr("fingervision.testbed.text_protocol.line.sleep", lambda seconds: None)
    virtual_time(monkeypatch, clock)
    return clock


@pytest.fixture
def device(clock: InterruptingClock) -> Iterator[Grbl]:
    device = Grbl()
    yield device
    device.close()


def run(
    device: Grbl,
    folder: Path,
    to_mm: float,
    step_mm: float,
    controls: Controls,
    on_row: Callable[[object, object], None],
    step: str = 'kind = "move"',
) -> None:
    path = CASES["grbl"].bed_at(folder, device, CAMERA.replace("rate_hz = 100.0", f"rate_hz = {RATE_HZ}"))
    text = path.read_text(encoding="utf-8").replace("settling_s", f"encoder_step_mm = {step_mm}\nsettling_s")
    path.write_text(text, encoding="utf-8")
    recipe = read_recipe(recipe_at(folder, steps(f"{step}\nto_mm = {to_mm}\nspeed_mm_s = 0.5")))
    bed = open_bed(str(path))
    try:
        run_recipe(recipe, bed, folder / "run", controls=controls, on_row=on_row)
    finally:
        bed.close()


def assert_true(rows: list[SampleRow], plant: Plant) -> None:
    # The simulated camera exposes 8 ms before a frame arrives, and a little later than that at random.
    late_s = min(row.arrived_s - row.camera_s for row in rows) - 0.008
    for row in rows:
        assert row.input_mm == pytest.approx(plant.was_at(row.camera_s + late_s), abs=KNOWN_WITHIN_MM)


@pytest.mark.parametrize("to_mm", [0.507, 0.513])
def test_rows_are_where_the_stage_was_also_where_it_starts_and_arrives(
    to_mm: float, device: Grbl, tmp_path: Path
) -> None:
    run(device, tmp_path, to_mm, 0.0, Controls(), lambda row, picture: None)
    assert_true(read_samples(tmp_path / "run" / "samples.csv"), device.plant)


@pytest.mark.parametrize(("frames", "step_mm"), [(0.3, 0.0), (0.9, 0.005)])
def test_the_last_rows_before_an_interruption_are_where_the_stage_was(
    frames: float, step_mm: float, clock: InterruptingClock, device: Grbl, tmp_path: Path
) -> None:
    controls = Controls()

    def interrupt(row: object, picture: object) -> None:
        if device.plant.at() > 0.4 and clock.controls is None and not controls.stopped:
            clock.controls, clock.at_s = controls, clock.now_s() + frames / RATE_HZ

    with pytest.raises(StateError):
        run(device, tmp_path, 2.0, step_mm, controls, interrupt)
    assert_true(read_samples(tmp_path / "run" / "samples.csv")[-6:], device.plant)


@pytest.mark.parametrize(("from_mm", "unwritten"), [(0.0, 0), (0.2, 12)])
def test_an_interrupted_motion_is_repeated_from_where_it_began(
    from_mm: float, unwritten: int, device: Grbl, tmp_path: Path
) -> None:
    controls, seen = Controls(), []

    def interrupt(row: SampleRow, picture: object) -> None:
        seen.append(row.input_mm or 0.0)
        if len(seen) > 3 and 0.4 < seen[-1] < seen[-2]:  # on the way back
            controls.stop()

    step = f'kind = "triangle"\nfrom_mm = {from_mm}'
    with pytest.raises(StateError):
        run(device, tmp_path, 0.6, 0.0, controls, interrupt, step)
    table = tmp_path / "run" / "samples.csv"
    lines = table.read_bytes().splitlines(keepends=True)
    table.write_bytes(b"".join(lines[: len(lines) - unwritten]))  # as a killed program leaves it
    run(device, tmp_path, 0.6, 0.0, Controls(), lambda row, picture: None, step)
    rows = read_samples(table)
    assert_true(rows, device.plant)
    again = [row.input_mm for row in rows if row.run == "2" and row.input_mm is not None]
    turn = again.index(max(again))
    assert max(again) == pytest.approx(0.6, abs=0.005)
    for way in (again[: turn + 1], again[turn:][::-1]):  # every frame of both ways, at 0.02 mm each
        assert max(b - a for a, b in pairwise(way)) < 0.03
    assert again[-1] == pytest.approx(from_mm, abs=0.005)
