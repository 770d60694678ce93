"""Force sensors and channels that talk in lines of text: values, slow instruments, faults, columns of samples.csv."""

import time
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fingervision.domain.errors import DataError, DeviceError
from fingervision.domain.status import Status
from fingervision.storage.drive_csv import read_samples, row_with, write_rows
from fingervision.storage.recipe_toml import read_recipe
from fingervision.tables.read import read_measured_table
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.text_protocol import line
from fingervision.testing import ForceSensorContract, run
from tests.testbed.stages.emulators import Emulator, Meter, PrintedNumbers
from tests.testbed.stages.stage_cases import CAMERA, GRIPPER

pytestmark = pytest.mark.filterwarnings("ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning")
FILES = Path(line.__file__).with_name("files")
RECIPE = 'schema = 1\n[[step]]\nkind = "hold"\nat_mm = 0.0\nseconds = 0.6\n'
SIM = """
spec: "1.1"
devices:
  meter:
    eom: {TCPIP INSTR: {q: "\\n", r: "\\n"}}
    dialogues:
      - {q: "*IDN?", r: "Maker,DMM,1,1.0"}
      - {q: "READ?", r: "+2.500000E+00"}
resources:
  TCPIP0::127.0.0.1::inst0::INSTR: {device: meter}
"""


@pytest.fixture
def bed_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Bed]:
    monkeypatch.setattr("fingervision.testbed.text_protocol.line.sleep", lambda seconds: None)
    # pyserial's socket sleeps when it is closed.
    monkeypatch.setattr("serial.urlhandler.protocol_socket.time", SimpleNamespace(sleep=lambda seconds: None))

    def opened(lines: str) -> Bed:
        path = tmp_path / "bed.toml"
        (tmp_path / "gripper.csv").write_text(GRIPPER, encoding="utf-8")
        path.write_text(f'schema = 1\n[actuator]\nkind = "simulated"\n{lines}{CAMERA}', encoding="utf-8")
        return open_bed(str(path))

    return opened


def force(words: str, port: str, more: str = "") -> str:
    return f'[force_sensor]\nkind = "serial_text"\nwords = "{words}"\nport = "{port}"\nfull_scale_n = 5\n{more}'


@pytest.mark.parametrize(
    ("make", "words", "more", "expected_n"),
    [
        (Meter, "scpi", "scale = 2.0\nzero = 0.25\n", 2.0),
        (Meter, "mettler_sics", "", 1.25 * 0.00980665),
        (PrintedNumbers, "printed_numbers", "scale = 1e-5\nzero = 4000\n", 0.8),
    ],
)
def test_a_force_sensor_keeps_the_contract(
    make: Callable[[], Emulator], words: str, more: str, expected_n: float, bed_of: Callable[[str], Bed]
) -> None:
    device = make()
    assert run(ForceSensorContract, open_bed=lambda: bed_of(force(words, device.port, more))) == {}
    bed = bed_of(force(words, device.port, more))
    assert bed.force_sensor is not None
    assert bed.force_sensor.readings()[-1].value == pytest.approx(expected_n)
    bed.close()
    device.close()


@pytest.mark.parametrize("fault", ["nonsense", "silent"])
@pytest.mark.parametrize(("make", "words"), [(Meter, "scpi"), (PrintedNumbers, "printed_numbers")])
def test_a_force_sensor_that_fails_is_said(
    make: Callable[[], Emulator], words: str, fault: str, tmp_path: Path, bed_of: Callable[[str], Bed]
) -> None:
    text = (FILES / f"{words}.toml").read_text(encoding="utf-8").replace("answer_s = 2.0", "answer_s = 0.2")
    (tmp_path / "hasty.toml").write_text(text, encoding="utf-8")
    device = make()
    bed = bed_of(force("./hasty.toml", device.port, "patience_s = 0.3\n"))
    assert bed.force_sensor is not None
    setattr(device, fault, True)
    with pytest.raises(DeviceError, match="must send values while the test bed works"):
        [bed.force_sensor.readings() for _ in range(100)]
    bed.close()
    device.close()


def test_a_visa_instrument_of_another_simulator_is_read(tmp_path: Path, bed_of: Callable[[str], Bed]) -> None:
    pytest.importorskip("pyvisa_sim", reason="pyvisa-sim is not installed")
    (tmp_path / "sim.yaml").write_text(SIM, encoding="utf-8")
    bed = bed_of(force("scpi", f"TCPIP0::127.0.0.1::inst0::INSTR@{tmp_path / 'sim.yaml'}@sim"))
    assert bed.force_sensor is not None
    assert bed.force_sensor.readings()[-1].value == 2.5
    bed.close()


def test_channels_become_columns_and_a_slow_one_does_not_slow_the_frames(
    tmp_path: Path, bed_of: Callable[[str], Bed]
) -> None:
    slow, fast = Meter(), PrintedNumbers()
    both = (("temperature_degc", "scpi", slow, 20), ("load_n", "printed_numbers", fast, 1e-5))
    channels = "".join(
        f'[[channel]]\nname = "{name}"\nwords = "{words}"\nport = "{device.port}"\nscale = {scale}\n'
        for name, words, device, scale in both
    )
    bed = bed_of(channels)
    assert [len(channel.readings()) > 0 for channel in bed.channels.values()] == [True, True]
    slow.takes_s = 0.4
    recipe = tmp_path / "recipe.toml"
    recipe.write_text(RECIPE, encoding="utf-8")
    began_s = time.monotonic()
    run_recipe(read_recipe(recipe), bed, tmp_path / "run")
    rows = read_samples(tmp_path / "run" / "samples.csv")
    assert len(rows) > 5
    assert time.monotonic() - began_s < 0.4 * (len(rows) + 75)  # one answer of the slow one a frame would take as long
    assert rows[-1].temperature_degc == pytest.approx(25.0)  # type: ignore[attr-defined]  # a column of this bed
    assert rows[-1].load_n == pytest.approx(0.84)  # type: ignore[attr-defined]
    header = (tmp_path / "run" / "samples.csv").read_text().splitlines()[0]
    assert header.endswith(",camera_s,arrived_s,temperature_degc,load_n")
    bed.close()
    slow.close()
    fast.close()


def test_the_diagnosis_reads_the_same_from_a_table_with_channels(tmp_path: Path) -> None:
    names = ("temperature_degc", "load_n", "input_v", "force", "direction")
    seen = []
    for channels in ((), names):
        rows = [
            row_with(channels)(
                "1", 0.04 * k, at_mm, 0.5 + 0.3 * at_mm, -0.2 * at_mm, 0.5 + 0.1 * at_mm, 0.001, 0.0005, 0.3,
                Status.OK, k, 1, at_mm, 0.04 * k, 0.04 * k + 0.01, **dict.fromkeys(channels, 7.0 + k),
            )
            for k, at_mm in enumerate(np.sin(np.linspace(0.0, 6.0, 60)).tolist())
        ]  # fmt: skip
        write_rows(tmp_path / "samples.csv", rows)
        seen.append(read_measured_table(tmp_path / "samples.csv"))
    for of in fields(seen[0]):
        assert_array_equal(*(getattr(table, of.name) for table in seen))


@pytest.mark.parametrize("name", ["gap_mm", "two words", "", "1st"])
def test_a_name_that_is_no_column_is_refused_with_its_line(name: str, bed_of: Callable[[str], Bed]) -> None:
    with pytest.raises(DataError, match=r"name in line 5 .*other column's name"):
        bed_of(f'[[channel]]\nname = "{name}"\nwords = "scpi"\nport = "/dev/nothing"\n')
