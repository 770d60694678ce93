"""Bad input of every kind: one sentence with the fact in it, the right exit code, never a traceback or a wait."""

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import click
import cv2
import numpy as np
import pytest

from fingervision.cli import cli, main
from fingervision.cli._command import Number
from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from tests.clips import FFV1, write_clip

MODEL = 'schema = 1\nbase = "sim.csv"\n'
RECIPE = 'schema = 1\nname = "x"\nbelow_force_n = 5.0\n'
TRIANGLE = '[[step]]\nkind = "triangle"\nfrom_mm = 0\nto_mm = 1\nspeed_mm_s = %s\ncycles = %s\n'
TABLE = "time_s,input_mm,gap_mm\n"
FILES: dict[str, str | bytes] = {
    "sim.csv": "input_mm,gap_mm\n0,1\n1,2\n",
    "m.csv": TABLE + "".join(f"{k / 10},{k / 20},{1 + k / 20}\n" for k in range(20)),
    "two.csv": "time_s,input_mm,gap_mm,gap_mm\n0,0,1,2\n1,1,2,3\n",
    "latin.csv": "time_s,input_mm,gap_mm,note\n0,0,1,é\n".encode("latin1"),
    "nul.csv": TABLE + "0,0,1\n1,\x00,2\n",
    "quote.csv": 'time_s,input_mm,gap_mm,run\n0,0,1,"a\n',
    "nan.csv": TABLE + "0,0,nan\n",
    "empty.csv": "",
    "head.csv": TABLE,
    "below.csv": TABLE.replace("\n", ",u_gap_mm\n")
    + "".join(f"{k},{k},{k},{0.01 - 0.02 * (k == 7)}\n" for k in range(9)),
    "short.csv": TABLE + "0,0,1\n1,1\n",
    "text.csv": "hello world\n",
    "json.csv": '{"a": 1}\n',
    "grouped.csv": TABLE + "".join(f"{k},{k},{k}_0\n" for k in range(20)),
    "arabic.csv": TABLE + "".join(f"{k},{k},{chr(0x661 + k % 9)}\n" for k in range(20)),
    "binary.csv": bytes(range(256)) * 20,
    "late.csv": "time_s,input_mm\n100,0\n101,1\n",
    "back.csv": "time_s,input_mm\n1,0\n0,1\n",
    "same.csv": "time_s,input_mm\n0,0\n0,1\n",
    "self.toml": 'schema = 1\nbase = "self.toml"\n',
    "a.toml": 'schema = 1\nbase = "b.toml"\n',
    "b.toml": 'schema = 1\nbase = "a.toml"\n',
    "latin.toml": 'schema = 1\nbase = "sim\xe9.csv"\n'.encode("latin1"),
    "wide.toml": f"{MODEL}".encode("utf-16"),
    "wide_unmarked.toml": f"{MODEL}".encode("utf-16-le"),
    "wide_bed.toml": RECIPE.encode("utf-16"),
    "wide.json": '{"schema": 1, "px_per_mm": 20}'.encode("utf-16"),
    "unclosed.toml": 'schema = 1\nbase = "sim.csv\n',
    "effect3.toml": f"{MODEL}effect = 3\n",
    "schema9.toml": 'schema = 9\nbase = "sim.csv"\n',
    "schema_text.toml": 'schema = "1"\nbase = "sim.csv"\n',
    "base3.toml": "schema = 1\nbase = 3\n",
    "base_empty.toml": 'schema = 1\nbase = ""\n',
    "base_nul.toml": 'schema = 1\nbase = "sim\\u0000.csv"\n',
    "magic.toml": f'{MODEL}[[effect]]\nname = "magic"\n[effect.parameters]\nx = {{ value = 1 }}\n',
    "infinite.toml": f'{MODEL}[[effect]]\nname = "backlash"\n[effect.parameters]\nplay_mm = {{ value = 1e400 }}\n',
    "twice.toml": "schema = 1\nschema = 1\n",
    "empty.toml": "",
    "nowhere.toml": 'schema = 1\nbase = "nowhere/sim.csv"\n',
    "dance.toml": f'{RECIPE}[[step]]\nkind = "dance"\n',
    "step3.toml": f"{RECIPE}step = 3\n",
    "far.toml": f'{RECIPE}[[step]]\nkind = "move"\nto_mm = 1e9\nspeed_mm_s = 1\n',
    "still.toml": RECIPE + TRIANGLE % ("0", "1"),
    "endless.toml": RECIPE + TRIANGLE % ("1", "1000000000"),
    "deep.json": "[" * 5000,
    "deep.toml": f"a = {'[' * 3000}{']' * 3000}\n",
    "timed.csv": TABLE + "".join(f"{k},0.{k},4.{k}\n" for k in range(9)),
    "own.py": "def simulate(time_s, input_mm):\n    return 4.0 + input_mm\n",
    "list.json": "[]",
    "null.json": '{"schema": 1, "px_per_mm": null}',
    "nan.json": '{"schema": 1, "px_per_mm": NaN}',
    "empty.json": "",
    "text.png": "no png",
    "zero.png": "",
    "images/a.png": "x",
    "folder/.keep": "",
    "folder.csv/.keep": "",
    "folder.toml/.keep": "",
}
SCALE = ("--px-per-mm", "20")
LONG = "a" * 5000


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("bad")
    rng = np.random.default_rng(0)
    scenes = [two_fingers(60.0 + k, below_tip_px=6.0, width_px=40.0, frame=(240, 200)) for k in range(2)]
    frames = (Frame(render(each, Camera(), rng), k, 0.04 * k) for k, each in enumerate(scenes))
    write_clip(found / "c.mkv", frames, FFV1)
    (found / "good").mkdir()
    cv2.imwrite(str(found / "good" / "a.png"), render(scenes[0], Camera(), rng))
    for name, content in FILES.items():
        (found / name).parent.mkdir(exist_ok=True)
        (found / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    for suffix in ("toml", "json", "csv", "mp4"):
        os.mkfifo(found / f"pipe.{suffix}")
        (found / f"loop.{suffix}").symlink_to(f"loop.{suffix}")
    return found


Refused = Callable[..., tuple[int, str]]


@pytest.fixture
def refused(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Refused:
    monkeypatch.chdir(folder)

    def command(*arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["fingervision", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), capsys.readouterr().err

    return command


def diagnose(measured: str, model: str = "sim.csv", *more: str) -> tuple[str, ...]:
    return ("diagnose", measured, "--model", model, "--out", "o", *more)


def measure(recording: str, *more: str) -> tuple[str, ...]:
    return ("measure", recording, *SCALE, *more)


def calibrated(file: str) -> tuple[str, ...]:
    return ("measure", "c.mkv", "--calibration", file)


def bed(recipe: str) -> tuple[str, ...]:
    return ("bed", "run", recipe, "--bed", "simulated", "--out", "run")


CASES: list[tuple[tuple[str, ...], int, str]] = [
    (diagnose("m.csv", "sim.csv", "--seed", "-1"), 2, "-1 is not in the range"),
    (("compare", "m.csv", "--model", "sim.csv", "--seed", "-1"), 2, "-1 is not in the range"),
    (("demo", "--seed", "-1"), 2, "-1 is not in the range"),
    # Pipes, where a document is asked for: reading one waits for ever.
    (diagnose("m.csv", "pipe.toml"), 1, "pipe.toml"),
    (diagnose("pipe.csv"), 1, "pipe.csv"),
    (diagnose("m.csv", "pipe.csv"), 1, "pipe.csv"),
    (calibrated("pipe.json"), 1, "pipe.json"),
    (measure("c.mkv", "--drive", "pipe.csv"), 1, "pipe.csv must be a table in a file, but is a folder or a pipe"),
    (measure("c.mkv", "--response", "pipe.csv"), 1, "pipe.csv"),
    (measure("pipe.mp4"), 1, "pipe.mp4 must be a file or a folder, but is a pipe or a device"),
    (bed("pipe.toml"), 1, "pipe.toml"),
    (("model", "pipe.toml"), 1, "pipe.toml"),
    (("batch", "diagnose", "m.csv", "--model", "pipe.toml", "--out", "o"), 1, "pipe.toml"),
    (("calibrate", "repeat", "pipe.csv"), 1, "pipe.csv"),
    (("calibrate", "check", "pipe.json", "text.png=1"), 1, "pipe.json"),
    (("live", "pipe.mp4", *SCALE), 1, "pipe.mp4"),
    (("live", "simulated", "--host", "0.0.0.0", "--password-file", "pipe.json"), 1, "pipe.json"),
    # Links that lead back to themselves.
    (diagnose("loop.csv"), 1, "loop.csv"),
    (diagnose("m.csv", "loop.toml"), 1, "loop.toml"),
    (calibrated("loop.json"), 1, "loop.json"),
    (measure("loop.mp4"), 1, "loop.mp4"),
    (bed("loop.toml"), 1, "loop.toml"),
    (("model", "loop.toml"), 1, "loop.toml"),
    (measure("c.mkv", "--out", "loop.csv"), 1, "loop.csv"),
    (("batch", "measure", "loop.mp4", *SCALE, "--out", "o"), 1, "loop.mp4"),
    # Empty names.
    *(
        (arguments, 2, "is empty")
        for arguments in (
            diagnose(""),
            diagnose("m.csv", ""),
            measure(""),
            measure("c.mkv", "--out", ""),
            measure("c.mkv", "--drive="),
            calibrated(""),
            bed(""),
            ("model", ""),
            ("batch", "measure", "", *SCALE, "--out", "o"),
            ("live", "", *SCALE),
            ("calibrate", "bar", "", "-o", "x.json"),
        )
    ),
    (("calibrate", "bar", "=1", "-o", "x.json"), 2, "=1"),
    (("calibrate", "bar", "text.png=", "-o", "x.json"), 2, "text.png="),
    # Sources without an end, drives that never overlap.
    (measure("simulated"), 2, "simulated is a camera, which does not"),
    (("batch", "measure", "simulated", *SCALE, "--out", "o"), 1, "simulated"),
    (measure("/dev/zero"), 1, "/dev/zero"),
    (measure("c.mkv", "--drive", "late.csv", "--out", "late"), 1, "drive-offset-s"),
    (
        measure("c.mkv", "--drive", "late.csv", "--drive-offset-s", "0", "--out", "late0"),
        1,
        "drive's times (100 to 101 s",
    ),
    (measure("c.mkv", "--drive", "quote.csv", "--drive-offset-s", "0"), 1, "quote"),
    (measure("c.mkv", "--frames", "7:9"), 1, "ends before frame 7"),
    (measure("c.mkv", "--drive", "back.csv"), 1, "must increase"),
    (measure("c.mkv", "--drive", "same.csv"), 1, "must increase"),
    (measure("c.mkv", "--drive", "folder.csv"), 1, "folder.csv"),
    (measure("c.mkv", "--drive", "late.csv", "--drive-offset-s", "nan"), 2, "nan"),
    # Tables.
    (diagnose("two.csv"), 1, "gap_mm occurs twice"),
    (diagnose("m.csv", "two.csv"), 1, "gap_mm occurs twice"),
    (diagnose("latin.csv"), 1, "accept=constant_input"),
    (diagnose("nul.csv"), 1, "zero bytes"),
    (diagnose("quote.csv"), 1, "quote"),
    (diagnose("nan.csv"), 1, "nan"),
    (diagnose("empty.csv"), 1, "empty"),
    (diagnose("head.csv"), 1, "has 0"),
    (diagnose("below.csv"), 1, "-0.01 in data row 8"),
    (diagnose("short.csv"), 1, "Line 3"),
    (diagnose("text.csv"), 1, "two numbers"),
    (diagnose("json.csv"), 1, "JSON"),
    (diagnose("binary.csv"), 1, "zero bytes"),
    (diagnose("grouped.csv"), 1, "0_0"),
    (diagnose("arabic.csv"), 1, "\u0661"),
    (diagnose("m.csv/x"), 1, ": Not a directory."),
    (diagnose("folder.csv"), 1, "folder.csv"),
    (diagnose("nothing.csv"), 1, "There is no table nothing.csv"),
    (diagnose("m.csv", "head.csv"), 1, "two rows"),
    # Models.
    (diagnose("m.csv", "self.toml"), 1, "is the file itself or a model based on it"),
    (diagnose("m.csv", "a.toml"), 1, "is the file itself or a model based on it"),
    (diagnose("m.csv", "latin.toml"), 1, "latin.toml"),
    (diagnose("m.csv", "latin.toml"), 1, "0xe9 in line 2"),
    (diagnose("m.csv", "wide.toml"), 1, "UTF-16"),
    (diagnose("m.csv", "wide_unmarked.toml"), 1, "save it with the encoding UTF-8"),
    (("model", "wide.toml"), 1, "UTF-16"),
    (measure("c.mkv", "--gauges", "wide.toml"), 1, "UTF-16"),
    (measure("c.mkv", "--settings", "wide.toml"), 1, "UTF-16"),
    (calibrated("wide.json"), 1, "UTF-16"),
    (bed("wide_bed.toml"), 1, "UTF-16"),
    (diagnose("m.csv", "unclosed.toml"), 1, "line 2"),
    (diagnose("m.csv", "effect3.toml"), 1, "must be tables [[effect]], but is 3"),
    (diagnose("m.csv", "schema9.toml"), 1, "schema"),
    (diagnose("m.csv", "schema_text.toml"), 1, "'1'"),
    (diagnose("m.csv", "base3.toml"), 1, "must be a text, but is 3"),
    (diagnose("m.csv", "base_empty.toml"), 1, "name of a file, but is ''"),
    (diagnose("m.csv", "base_nul.toml"), 1, "name of a file"),
    (("batch", "diagnose", "m.csv", "--model", "base_nul.toml", "--out", "o", "--jobs", "1"), 1, "base_nul.toml"),
    (diagnose("m.csv", "magic.toml"), 1, "magic"),
    (diagnose("m.csv", "infinite.toml"), 1, "inf"),
    (diagnose("m.csv", "twice.toml"), 1, "twice.toml"),
    (diagnose("m.csv", "empty.toml"), 1, "empty.toml"),
    (diagnose("m.csv", "nowhere.toml"), 1, "nowhere/sim.csv"),
    (diagnose("m.csv", "folder.toml"), 1, "folder.toml"),
    (diagnose("m.csv", "sim.csv", "--with", "magic"), 2, "magic"),
    (diagnose("m.csv", "sim.csv", "--with", "backlash", "--without", "backlash"), 2, "backlash"),
    (("model", "sim.csv"), 1, "sim.csv"),
    # Calibrations.
    *((calibrated(f"{name}.json"), 1, f"{name}.json") for name in ("deep", "list", "null", "nan", "empty")),
    # Recipes.
    (bed("dance.toml"), 1, "danc"),
    (("bed", "recipe", "sinus"), 2, "KIND must be a kind of step, but is 'sinus': did you mean sine?"),
    (("bed", "recipe", "dance"), 2, "staircase"),
    (("effects", "backlsh"), 2, "did you mean backlash?"),
    (bed("step3.toml"), 1, "[[step]]"),
    (bed("far.toml"), 1, "1e+09"),
    (bed("still.toml"), 1, "speed_mm_s"),
    (bed("endless.toml"), 1, "cycles"),
    (bed("folder.toml"), 1, "folder.toml"),
    # Recordings and options.
    (measure("text.png"), 1, "text.png"),
    (measure("zero.png"), 1, "zero.png"),
    (measure("images"), 1, "a.png"),
    (measure("images", "--rate-hz", "-5"), 2, "-5"),
    (measure("good", "--rate-hz", "1e-300"), 2, "between 1e-06 and 1e+07"),
    (measure("c.mkv", "--below-tip-mm", "1e9"), 2, "240x200 pixels"),
    (measure("folder"), 1, "folder"),
    (measure("["), 1, "["),
    (measure("\x1b[31mred\x07.mkv"), 1, r"\x1b[31mred\x07.mkv"),
    (measure(LONG), 1, "too long"),
    (measure("c.mkv", "--out", LONG), 1, "cannot be written"),
    (measure("c.mkv", "--out", "c.mkv"), 1, "is a file"),
    (measure("c.mkv", "--roi", "-1,0,10,10"), 2, "-1,0,10,10"),
    (measure("c.mkv", "--roi", "0,0,99999999999999999999,1"), 2, "240x200"),
    (measure("c.mkv", "--bits", "99"), 2, "99"),
    (("measure", "c.mkv", "--px-per-mm", "1e-300"), 2, "1e-300"),
    (("measure", "c.mkv", "--px-per-mm", "1e300"), 2, "1e+300"),
    (("live", "simulated", "--px-per-mm", "1e-300"), 2, "1e-300"),
    (("live", "simulated", "--port", "99999"), 2, "99999"),
    (("live", "simulated", "--rate-hz", "nan"), 2, "nan"),
    (("live", "http://[::1", *SCALE), 1, "http://[::1"),
    (("batch", "measure", "c.mkv", *SCALE, "--out", "c.mkv"), 2, "c.mkv"),
    (("batch", "measure", "c.mkv", *SCALE, "--out", "o", "--jobs", "0"), 2, "0 is not in the range"),
    (("calibrate", "bar", "text.png=nan", "-o", "x.json"), 2, "nan"),
    (("calibrate", "chessboard", "text.png", "--squares", "0x0", "--square-mm", "1", "-o", "x.json"), 1, "0x0"),
    (("effects", "magic"), 2, "magic"),
    (("nonsense",), 2, "nonsense"),
    (("mesure", "c.mkv"), 2, "measure"),
    (("model", "deep.toml"), 1, "nested"),
    (diagnose("timed.csv", "deep.toml"), 1, "nested"),
    (bed("deep.toml"), 1, "nested"),
    (diagnose("timed.csv", "own.py:solve"), 2, "simulate"),
    (("measure", "c.mkv", "--px-per-mm", "1,234"), 2, "1.234 or 1234"),
    (("bed", "jog", "1", "--for-s", "-1,5"), 2, "greater than 0, but is -1.5"),
    (("calibrate", "bar", "text.png=5,000"), 2, "5.0 or 5000"),
]


@pytest.mark.parametrize(("arguments", "code", "fact"), CASES, ids=[" ".join(case[0])[:60] for case in CASES])
def test_bad_input_is_one_sentence_and_its_code(
    refused: Refused, arguments: tuple[str, ...], code: int, fact: str
) -> None:
    found, said = refused(*arguments)
    assert fact in said
    assert "Traceback" not in said
    assert said.strip().splitlines()[-1].startswith(("fingervision: ", "Error: "))
    assert found == code


def test_numbers_with_a_comma_and_a_function_of_a_file_are_understood(refused: Refused) -> None:
    code, said = refused("measure", "c.mkv", "--px-per-mm", "20,0", "--below-tip-mm", "0,3", "--out", "comma")
    assert (code, said) == (0, "")
    code, said = refused("compare", "timed.csv", "--model", "own.py:simulate", "--out", "compared")
    assert (code, said) == (0, "")


def _parameters(command: click.Command, context: click.Context) -> Iterator[click.Parameter]:
    yield from command.params
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            assert inner is not None
            yield from _parameters(inner, click.Context(inner))


def test_every_decimal_number_of_every_command_is_read_by_the_same_type() -> None:
    found = list(_parameters(cli, click.Context(cli)))
    assert sum(isinstance(each.type, Number) for each in found) > 40
    assert [each.name for each in found if type(each.type) in (type(click.FLOAT), click.FloatRange)] == []


@pytest.mark.parametrize("asked", [False, True])
def test_an_unexpected_error_is_a_sentence_with_its_traceback_in_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], asked: bool
) -> None:
    def fail(**_: object) -> None:
        raise LookupError("no such\x1b row")

    monkeypatch.setattr("fingervision.cli.cli", fail)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    if asked:
        monkeypatch.setenv("FINGERVISION_TRACEBACK", "1")
    with pytest.raises(LookupError if asked else SystemExit):
        main()
    said = capsys.readouterr().err
    assert "Traceback" not in said
    if not asked:
        (kept,) = tmp_path.iterdir()
        assert all(fact in said for fact in ("LookupError: no such\\x1b row", str(kept)))
        assert "in fail" in kept.read_text()


def test_a_link_that_leads_back_to_itself_is_a_sentence_wherever_it_is_met(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "loop").symlink_to("loop")
    monkeypatch.setattr("fingervision.cli.cli", lambda **_: (tmp_path / "loop").resolve(strict=True))
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 1
    assert "leads back to itself" in capsys.readouterr().err


def test_a_folder_that_is_gone_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    monkeypatch.setattr(sys, "argv", ["fingervision", "effects"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 1
    assert "current folder" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)
