"""Files of words: the one of the manual drives its invented controller, and mistakes are named with their line."""

import os
import re
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest
import serial
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.domain.errors import DataError, DeviceError, FingervisionError
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.manual import manual_control
from fingervision.testbed.manual.manual_control import stop_bed
from fingervision.testbed.text_protocol.words import known_words
from tests.testbed.stages.emulators import Conex, Emulator, Invented, Wire, Zaber
from tests.testbed.stages.stage_cases import CASES, Case, text

pytestmark = pytest.mark.usefixtures("virtual")
PAGE = (Path(__file__).parents[3] / "docs" / "how_to" / "stages.md").read_text(encoding="utf-8")
EXAMPLE = re.search(r"```toml\n( *# my_stage\.toml\n.*?)```", PAGE, re.DOTALL)[1].replace("\n   ", "\n")  # type: ignore[index]
# What a reader of the page wrote for a controller that no file of the package knows.
CONEX = """
schema = 1
name = "Newport CONEX-CC"
baud = 921600
line_end = "\\r\\n"
[settings]
axis = 1
[[open]]
say = "{axis}ID?"
reply = '^{axis}ID'
[position]
say = "{axis}TP"
reply = '^{axis}TP([-+\\d.eE]+)$'
[busy]
say = "{axis}TS"
reply = '^{axis}TS[0-9A-F]{4}([0-9A-F]{2})$'
moving = '^(28|1E)$'
[move]
say = ["{axis}VA{speed:.4f}", "{axis}PA{to:.5f}"]
[check]
say = "{axis}TE"
reply = '^{axis}TE(?:@|(.))$'
[home]
say = "{axis}OR"
[stop]
say = "{axis}ST"
"""


class Semicolons(Invented):
    """Answers end with a character that is no white space."""

    answer_end = b";"


def bed_with(words: str, device: Emulator, folder: Path) -> Path:
    (folder / "own.toml").write_text(words, encoding="utf-8")
    return Case(Invented, text("./own.toml")).bed_at(folder, device)


@pytest.mark.parametrize(
    ("words", "make"),
    [(EXAMPLE, Invented), (EXAMPLE.replace('answer_end = "\\n"', 'answer_end = ";"'), Semicolons), (CONEX, Conex)],
)
def test_a_file_of_ones_own_drives_its_controller(words: str, make: type[Emulator], tmp_path: Path) -> None:
    device = make()
    bed = open_bed(str(bed_with(words, device, tmp_path)))
    assert manual_control.home(bed) == 0.0
    assert manual_control.move(bed, 0.2, 2.0) == pytest.approx(0.2, abs=1e-4)
    assert device.plant.at() == pytest.approx(0.2, abs=1e-4)
    bed.close()
    device.close()


def test_a_refusal_before_homing_is_a_sentence_and_an_alarm(tmp_path: Path) -> None:
    device = Conex()
    bed = open_bed(str(bed_with(CONEX, device, tmp_path)))
    with pytest.raises(DeviceError, match="reported H: remove the cause, and home"):
        bed.actuator.move(0.1, 1.0)
    assert bed.actuator.alarm is not None
    manual_control.home(bed)
    assert bed.actuator.alarm is None
    bed.close()
    device.close()


@pytest.mark.parametrize(
    ("right", "wrong", "says"),
    [
        ("[stop]", "[halt]", r"halt in .*is not known|no \[stop\]"),
        ("{to:.5f}", "{too:.5f}", r"say in line 19 of .*own\.toml must have no placeholders but to, speed, axis"),
        ("'^(28|1E)$'", "'^(28|1E$'", "moving in line 1. .*regular expression"),
        ("{axis}TP([", "{axis}TP[[", "regular expression"),
        ("schema = 1", "schema = 9", "newer fingervision"),
    ],
)
def test_bed_check_names_a_mistake_without_the_controller(right: str, wrong: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(CONEX.replace(right, wrong), encoding="utf-8")
    (tmp_path / "recipe.toml").write_text('schema = 1\n[[step]]\nkind = "move"\nto_mm = 0.1\nspeed_mm_s = 1.0\n')
    limits = 'lower_mm = 0\nupper_mm = 1\nspeed_mm_s = 1\n[camera]\nkind = "simulated"\n[gripper]\n'
    bed = f"schema = 1\n[actuator]\n{text('./own.toml')}{limits}"
    (tmp_path / "bed.toml").write_text(bed.replace("PORT", "/dev/nothing"), encoding="utf-8")
    done = CliRunner().invoke(cli, ["bed", "check", str(tmp_path / "recipe.toml"), "--bed", str(tmp_path / "bed.toml")])
    assert done.exit_code == 1
    assert re.search(says, done.output + str(done.exception))


class Refusing(Invented):
    """Refuses one of its commands."""

    refused = ""

    def answer(self, line: str) -> list[str]:
        return ["ERR no"] if self.refused and self.refused in line else super().answer(line)


@pytest.mark.parametrize("refused", ["", "GOTO", "POS?", "ID?"])
def test_the_last_words_are_said_however_a_connection_ends(refused: str, tmp_path: Path) -> None:
    """Also after a refusal of a motion, of the first question and of the first words, and after `bed stop`."""
    device = Refusing()
    device.refused = refused
    path = str(bed_with(EXAMPLE + '\n[close]\nsay = "{axis}BYE"\n', device, tmp_path))
    for end in (lambda: stop_bed(path), lambda: moved(path)):
        device.heard.clear()
        with suppress(FingervisionError):
            end()
        device.settle()
        assert device.heard[-1].strip() == "1BYE"
    device.close()


def moved(path: str) -> None:
    bed = open_bed(path)
    try:
        manual_control.move(bed, 0.1, 1.0)
    finally:
        bed.close()


def test_a_setting_that_was_never_read_is_not_given_back(tmp_path: Path) -> None:
    """A Zaber stage that refuses its first question keeps its highest speed."""
    device = Zaber()
    device.do = lambda words: ("RJ", "BADCOMMAND")  # type: ignore[method-assign]
    with pytest.raises(DeviceError):
        open_bed(str(CASES["zaber"].bed_at(tmp_path, device)))
    device.settle()
    assert not [line for line in device.heard if "set maxspeed" in line]
    device.close()


def invoked(*words: object) -> str:
    done = CliRunner().invoke(cli, [str(word) for word in words])
    return f"{done.output}{done.exception or ''}"


@pytest.mark.parametrize("strays_mm", [0.0, 0.0004, -0.0004])
def test_a_zero_has_no_minus(strays_mm: float, tmp_path: Path) -> None:
    device = Invented()
    device.plant.strays_mm = strays_mm
    path = bed_with(EXAMPLE, device, tmp_path)
    path.write_text(path.read_text().replace("lower_mm = -2", "reversed = true\nlower_mm = -2"), encoding="utf-8")
    assert "homed: 0.000 mm" in invoked("bed", "home", "--bed", path)
    device.close()


@pytest.mark.parametrize("name", ["newport_esp", "kinesis"])
@pytest.mark.parametrize("before", [True, False])
def test_a_port_that_takes_nothing_is_a_sentence(
    name: str, before: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def blocked(self: Wire, data: bytes) -> None:
        raise serial.SerialTimeoutException("Write timeout")

    device = CASES[name].make()
    path = str(CASES[name].bed_at(tmp_path, device))
    bed = None if before else open_bed(path)
    monkeypatch.setattr(Wire, "write", blocked)
    with pytest.raises(DeviceError, match="must take what it is told within 1 s, but did not: switch it on") as caught:
        open_bed(path) if bed is None else bed.actuator.home()
    assert "Exception" not in str(caught.value)
    if bed is not None:
        with pytest.raises(
            DeviceError, match=r"must stop, .*must take what it is told within 1 s.*emergency stop"
        ) as caught:
            bed.actuator.stop()
        assert "Error" not in str(caught.value)
        bed.close()
    device.close()


def test_a_finished_folder_is_refused_before_the_port_is_opened(tmp_path: Path) -> None:
    device, out = Invented(), tmp_path / "run"
    path, recipe = bed_with(EXAMPLE, device, tmp_path), tmp_path / "recipe.toml"
    recipe.write_text('schema = 1\n[[step]]\nkind = "move"\nto_mm = 0.1\nspeed_mm_s = 1.0\n')
    out.mkdir()
    (out / "run.json").write_text('{"kind": "bed run", "complete": true}')
    assert "is finished already" in invoked("bed", "run", recipe, "--bed", path, "--out", out)
    assert device.heard == []
    device.close()


def test_the_digits_of_the_manual_are_those_with_the_bit() -> None:
    found = re.findall(r"^# moving = '(\S+)' +# (\d)$", PAGE, re.MULTILINE)
    assert [int(bit) for _, bit in found] == [1, 2, 4, 8]
    for words, bit in found:
        assert [number for number in range(256) if re.search(words, f"{number:02X}")] == [
            number for number in range(256) if number & int(bit)
        ]


def test_every_file_of_the_package_stands_in_the_manual() -> None:
    assert {name for name in known_words() if f"`{name}`" not in PAGE} == set()


def test_an_unknown_name_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    path = Case(Invented, text("grlb")).bed_at(tmp_path, Invented())
    with pytest.raises(DataError, match="did you mean grbl"):
        open_bed(str(path))


@pytest.mark.parametrize(
    ("replaced", "by", "said"),
    [
        (
            'say = "{axis}STOP"',
            'say = "{axis}STOP{to:.1f}"',
            r"say in line \d+ of .* must have no placeholders but axis,",
        ),
        (
            'say = "{axis}HOME"',
            'say = "{axis}HOME {speed}"',
            r"say in line \d+ of .* must have no placeholders but axis,",
        ),
        ("[stop]", "[check]\nsay = 'E?'\nreply = '^0$'\n[stop]", r"reply in line \d+ of .* must have a group"),
    ],
)
def test_words_that_could_not_be_said_or_understood_are_refused_before_anything_moves(
    replaced: str, by: str, said: str, tmp_path: Path
) -> None:
    assert replaced in EXAMPLE
    device = Invented()
    with pytest.raises(DataError, match=said):
        open_bed(str(bed_with(EXAMPLE.replace(replaced, by), device, tmp_path)))
    assert not device.heard
    device.close()


def test_a_number_outside_a_group_is_named(tmp_path: Path) -> None:
    device = Conex()
    with pytest.raises(DataError, match=r"must answer with a number, .* put a group, \( \), around the number"):
        open_bed(str(bed_with(CONEX.replace("TP([-+\\d.eE]+)$'", "TP'"), device, tmp_path)))
    device.close()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells which process has a port open")
def test_stop_ends_the_program_that_has_the_port_open(tmp_path: Path) -> None:
    ends, program = os.openpty(), tmp_path / "fingervision"
    program.write_text("import os, sys, time\nos.open(sys.argv[1], os.O_RDWR)\nprint(flush=True)\ntime.sleep(60)\n")
    path = bed_with(EXAMPLE, Invented(), tmp_path)
    port = os.ttyname(ends[1])
    path.write_text(re.sub(r"socket://[^\"]+", port, path.read_text()))
    with subprocess.Popen([sys.executable, str(program), port], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        waiting = threading.Thread(target=other.wait)
        waiting.start()
        with pytest.raises(DataError):  # nothing answers at the port itself
            stop_bed(str(path))
        waiting.join()
    assert other.returncode == -signal.SIGTERM
    for end in ends:
        os.close(end)
