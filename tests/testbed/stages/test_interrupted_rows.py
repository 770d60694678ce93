"""Every row that an interrupted run keeps states where the stage truly was, also the last ones before the stop."""

from pathlib import Path

import pytest

from fingervision.domain.errors import StateError
from fingervision.storage.recipe_toml import read_recipe
from fingervision.storage.samples_csv import read_samples
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.controls import Controls
from fingervision.testbed.run.recipe_run import run_recipe
from tests.testbed.simulated_beds import recipe_at, steps
from tests.testbed.stages.emulators import EmulatorsClock, Grbl, Time
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


@pytest.mark.parametrize("frames", [0.3, 0.9])
@pytest.mark.parametrize("step_mm", [0.0, 0.005])
def test_the_last_rows_before_an_interruption_are_where_the_stage_was(
    frames: float, step_mm: float, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    clock, controls, device = InterruptingClock(begin_s=100.0), Controls(), Grbl()
    monkeypatch.setattr("fingervision.testbed.bed_factory.HostClock", lambda: clock)
    monkeypatch.setattr("fingervision.testbed.text_protocol.line.sleep", lambda seconds: None)
    monkeypatch.setattr(Time, "now_s", clock.now_s)
    monkeypatch.setattr(Time, "due", [])
    path = CASES["grbl"].bed_at(tmp_path, device, CAMERA.replace("rate_hz = 100.0", f"rate_hz = {RATE_HZ}"))
    text = path.read_text(encoding="utf-8").replace("settling_s", f"encoder_step_mm = {step_mm}\nsettling_s")
    path.write_text(text, encoding="utf-8")
    recipe = recipe_at(tmp_path, steps('kind = "move"\nto_mm = 2.0\nspeed_mm_s = 0.5'))
    bed = open_bed(str(path))

    def interrupt(row: object, picture: object) -> None:
        if device.plant.at() > 0.4 and clock.controls is None and not controls.stopped:
            clock.controls, clock.at_s = controls, clock.now_s() + frames / RATE_HZ

    with pytest.raises(StateError):
        run_recipe(read_recipe(recipe), bed, tmp_path / "run", controls=controls, on_row=interrupt)
    bed.close()
    rows = read_samples(tmp_path / "run" / "samples.csv")[-6:]
    # The simulated camera's own clock: stamps are whole periods, exposed at the latency before they arrive.
    late_s = min(row.arrived_s - row.camera_s for row in rows)
    for row in rows:
        assert row.input_mm is not None
        exposed_s = row.camera_s + late_s - bed.camera.latency.least_s  # type: ignore[union-attr]
        assert row.input_mm == pytest.approx(device.plant.was_at(exposed_s), abs=KNOWN_WITHIN_MM)
    device.close()
