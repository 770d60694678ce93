"""Every example of every `--help` works in the folder that `fingervision example` copies for its command."""

import glob
import os
import re
import shlex
import shutil
from pathlib import Path

import av
import click
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.interface.examples import CASES, copy_example
from tests.commands import printed

# What nobody has at hand here: cameras, streams, a cluster; and what goes on until Ctrl-C. Their options are parsed.
NOT_HERE = re.compile(r"/dev/|://|fingervision (live|gauge) |bed jog -2|/lab/")
WORD = re.compile(r"""(?:[^\s'"]|'[^']*'|"[^"]*")+""")
# Minutes of processor time; tests of these commands run them with less to do.
LONG = re.compile(r"fingervision demo|--large-rotation")
# Of the sample recording: the stage rests, opens the gripper, and has begun to close it.
FRAMES = 150
COMMENT = re.compile(r"\s{2,}.*")


def commands(group: click.Group, path: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], click.Command]]:
    """All commands below a group, with the words that call them."""
    found = []
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        found.append(((*path, name), command))
        if isinstance(command, click.Group):
            found += commands(command, (*path, name))
    return found


def examples_of(command: click.Command) -> list[str]:
    """The examples of a command's help, without the words beside them."""
    lines = (command.epilog or "").splitlines() + (command.help or "").splitlines()
    return [COMMENT.sub("", line.strip()) for line in lines if line.strip().startswith("fingervision ")]


ALL = {" ".join(path): examples_of(command) for path, command in commands(cli)}
LEAVES = [" ".join(path) for path, command in commands(cli) if not isinstance(command, click.Group)]


def words_of(example: str) -> list[str]:
    """The example's words as a shell would hand them over: patterns without quotes are matched."""
    words: list[str] = []
    for raw in WORD.findall(example)[1:]:
        plain = shlex.split(raw)[0]
        is_pattern = glob.has_magic(raw) and raw == plain
        words += (sorted(str(each) for each in Path().glob(plain)) or [plain]) if is_pattern else [plain]
    return words


def shortened(recording: Path) -> None:
    """Keep the first frames of a recording as they are coded: enough for every example, in half the time."""
    whole = recording.with_name("whole.mp4")
    recording.rename(whole)
    with av.open(str(whole)) as source, av.open(str(recording), "w") as target:
        stream = source.streams.video[0]
        out = target.add_stream_from_template(stream, opaque=True)
        for number, packet in enumerate(source.demux(stream)):
            if packet.dts is None or number >= FRAMES:
                break
            packet.stream = out
            target.mux(packet)
    whole.unlink()


@pytest.mark.parametrize("name", LEAVES)
def test_every_command_has_an_example(name: str) -> None:
    assert ALL[name], name


@pytest.mark.parametrize("name", [name for name, examples in ALL.items() if examples])
def test_every_example_can_be_parsed(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    for example in ALL[name]:
        words = words_of(example)
        command: click.Command = cli
        while isinstance(command, click.Group):
            found = command.get_command(click.Context(command), words[0])
            assert found is not None, example
            command, words = found, words[1:]
        command.make_context(command.name, words)


# Minutes in all; a plain run has the examples of the manual and of the README, and every example is parsed in any case.
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, examples in ALL.items() if examples])
def test_every_example_runs_in_its_folder(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    case = name.partition(" ")[0]
    folder = tmp_path / "case"
    if case in CASES:
        copy_example(case, folder)
    else:
        folder.mkdir()
    if (folder / "opening.mp4").exists():
        shortened(folder / "opening.mp4")
    monkeypatch.chdir(folder)
    for example in ALL[name]:
        if NOT_HERE.search(example) or LONG.search(example):
            continue
        ended = CliRunner().invoke(cli, words_of(example))
        assert ended.exit_code == 0, f"{example}\n{ended.output}\n{ended.exception}"


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_the_command_to_begin_with_works(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    said = printed("example", name)
    assert CASES[name].run in said
    if CASES[name].run in ALL.get(name, []):
        return  # run above
    os.chdir(f"example-{name}")
    ended = CliRunner().invoke(cli, words_of(CASES[name].run))
    assert ended.exit_code == 0, ended.output


def test_a_folder_is_whole_or_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full/mine.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    (tmp_path / "empty").mkdir()
    for taken in ("full", "file"):
        ended = CliRunner().invoke(cli, ["example", "table", "--out", str(tmp_path / taken)])
        assert getattr(ended.exception, "exit_code", None) == 2
        assert "--out" in str(ended.exception)
    assert (tmp_path / "full/mine.txt").read_text() == "mine"
    assert CliRunner().invoke(cli, ["example", "table", "--out", str(tmp_path / "empty")]).exit_code == 0
    copied = shutil.copyfile

    def full_disk(source: Path, target: Path) -> None:
        if Path(target).name == "log.csv":
            raise OSError(28, "No space left on device")
        copied(source, target)

    monkeypatch.setattr("fingervision.interface.examples.shutil.copyfile", full_disk)
    ended = CliRunner().invoke(cli, ["example", "table", "--out", str(tmp_path / "new")])
    assert "No space left" in str(ended.exception)
    assert not (tmp_path / "new").exists()
    assert not list(tmp_path.glob(".*"))


def test_lists_the_cases_and_tells_the_nearest() -> None:
    listed = CliRunner().invoke(cli, ["example"]).output.splitlines()
    assert [line.split()[0] for line in listed] == list(CASES)
    ended = CliRunner().invoke(cli, ["example", "diagnos"])
    assert "did you mean diagnose?" in str(ended.exception)
