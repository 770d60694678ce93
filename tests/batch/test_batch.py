"""`fingervision batch` as its user meets it: results, what is done again and what is not, sentences, exit codes."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from fingervision.cli import main

SCALE = ("--px-per-mm", "20")
# One process starts sooner than two; what two give is held by the first test.
ALONE = (*SCALE, "--jobs", "1")
# Starting Python and our imports on a busy machine; nothing is measured by it.
PATIENCE_S = 90.0
TIMED = re.compile(r'"made_at": ".*?"')

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    monkeypatch.chdir(tmp_path)

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["fingervision", *(str(argument) for argument in arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        code = ended.value.code
        return (0 if code is None else int(code)), said.out, said.err

    return command


@pytest.fixture
def copy(recordings: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recordings, tmp_path / "rec"))


def lines(out: Path) -> list[dict[str, str]]:
    return list(csv.DictReader((out / "batch.csv").read_text(encoding="utf-8").splitlines()))


def numbers_of(folder: Path) -> dict[str, str | bytes]:
    """All that a measurement wrote but the time of day."""
    summary = TIMED.sub("", (folder / "summary.json").read_text(encoding="utf-8"))
    return {"summary": summary, **{name: (folder / name).read_bytes() for name in ("gaps.csv", "gap.png")}}


def made(out: Path) -> dict[str, int]:
    """When each result was written."""
    whole = (path for path in out.glob("*/gaps.csv") if not path.parent.name.startswith("."))
    return {path.parent.name: path.stat().st_mtime_ns for path in whole}


@pytest.mark.slow
def test_one_two_and_by_hand_are_the_same_and_a_broken_one_is_listed(run: Run, copy: Path, tmp_path: Path) -> None:
    code, out, err = run("batch", "measure", "rec/**/*.mkv", *SCALE, "--out", "two", "--jobs", 2)
    assert code == 3
    assert "4 of 5 inputs have a result (5 processed by this call)." in out
    assert err.startswith("fingervision: rec/b/broken.mkv must be a video")
    assert run("batch", "measure", "rec/**/*.mkv", *SCALE, "--out", "one", "--jobs", 1)[0] == 3
    table = lines(Path("two"))
    assert [(line["input"], line["result"], line["exit_code"]) for line in table] == [
        ("rec/a/good.mkv", "a__good.mkv", "0"),
        ("rec/b/broken.mkv", "", "1"),
        ("rec/b/good.mkv", "b__good.mkv", "0"),
        ("rec/b/good_too.mkv", "good_too.mkv", "0"),
        ("rec/c/good_last.mkv", "good_last.mkv", "0"),
    ]
    for line in table:
        if line["result"]:
            assert run("measure", line["input"], *SCALE, "--out", f"hand/{line['result']}")[0] == 0
            by_hand = numbers_of(Path("hand") / line["result"])
            assert numbers_of(Path("two") / line["result"]) == by_hand == numbers_of(Path("one") / line["result"])
            assert float(line["median_mm"]) == pytest.approx(
                json.loads((Path("hand") / line["result"] / "summary.json").read_text())["gap"]["median_mm"], rel=1e-8
            )
    page = Path("two/index.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 4
    assert 'href="a__good.mkv/gap.png"' in page
    assert not re.search(r'(src|href)="(https?:)?//', page)
    assert not list(Path("two").glob(".*"))


@pytest.mark.slow
def test_what_is_done_stays_and_what_changed_is_done_again(run: Run, copy: Path) -> None:
    arguments = ("batch", "measure", "rec/*/good*.mkv", "--out", "out", *ALONE)
    assert run(*arguments)[0] == 0
    first = made(Path("out"))
    assert len(first) == 4
    page = Path("out/index.html").stat().st_mtime_ns
    code, out, _ = run(*arguments)
    assert (code, made(Path("out"))) == (0, first)
    assert "nothing to do" in out
    assert Path("out/index.html").stat().st_mtime_ns == page
    # Another time of change with the same content is nothing new, another content is.
    os.utime("rec/a/good.mkv", ns=(1, 1))
    os.utime("rec/c/good_last.mkv", ns=(1, 1))
    shutil.copy("rec/b/good_too.mkv", "rec/b/good.mkv")
    run(*arguments)
    second = made(Path("out"))
    assert {name for name in second if second[name] != first[name]} == {"b__good.mkv"}
    assert Path("out/b__good.mkv/gaps.csv").read_bytes() == Path("out/good_too.mkv/gaps.csv").read_bytes()
    # Other options are other results; a default that is written out is none.
    assert "nothing to do" in run(*arguments, "--below-tip-mm", 0.3)[1]
    assert "4 processed by this call" in run(*arguments, "--below-tip-mm", 0.4)[1]


@pytest.mark.slow
def test_a_result_whose_table_was_changed_or_deleted_is_done_again(run: Run, copy: Path) -> None:
    arguments = ("batch", "measure", "rec/*/good*.mkv", "--out", "out", *ALONE)
    run(*arguments)
    changed, deleted = Path("out/good_too.mkv/gaps.csv"), Path("out/good_last.mkv/gaps.csv")
    whole = changed.read_bytes(), deleted.read_bytes()
    changed.write_bytes(whole[0].replace(b"ok", b"ko", 1))
    deleted.unlink()
    assert "2 processed by this call" in run(*arguments)[1]
    assert (changed.read_bytes(), deleted.read_bytes()) == whole
    assert "nothing to do" in run(*arguments)[1]


def test_recordings_of_one_name_have_results_of_their_own(run: Run, copy: Path) -> None:
    for folder in "ab":
        assert run("measure", f"rec/{folder}/good.mkv", *SCALE)[0] == 0
    assert run("measure", "rec/a/good.mkv", *SCALE)[0] == 0
    names = {path.parent.name: json.loads(path.read_text())["recording"]["name"] for path in made_by_hand()}
    assert names == {"good.mkv": "rec/a/good.mkv", "b__good.mkv": "rec/b/good.mkv"}


def made_by_hand() -> list[Path]:
    return list(Path("measured").glob("*/summary.json"))


@pytest.mark.slow
def test_the_content_of_a_calibration_counts_and_not_its_name(run: Run, copy: Path) -> None:
    sample = Path(__file__).parents[2] / "sample_frames" / "opening"
    document = json.loads((sample / "calibration.json").read_text(encoding="utf-8"))
    document |= {"frame_width": 240, "frame_height": 200}
    Path("c.json").write_text(json.dumps(document), encoding="utf-8")
    arguments = ("batch", "measure", "rec/a/good.mkv", "--jobs", 1, "--out", "out")
    code, out, err = run(*arguments, "--calibration", "c.json")
    if code != 0:
        pytest.fail(err + out)
    Path("c.json").rename("d.json")
    assert "nothing to do" in run(*arguments, "--calibration", "d.json")[1]
    document["made_at"] = "2026-01-01T00:00:00+00:00"
    Path("d.json").write_text(json.dumps(document), encoding="utf-8")
    assert "1 processed by this call" in run(*arguments, "--calibration", "d.json")[1]


@pytest.mark.slow
def test_a_recording_of_a_taken_name_gets_a_longer_one(run: Run, copy: Path) -> None:
    run("batch", "measure", "rec/a/good.mkv", *ALONE, "--out", "out")
    before = made(Path("out"))
    assert run("batch", "measure", "rec/b/good.mkv", *ALONE, "--out", "out")[0] == 0
    assert set(made(Path("out"))) == {"good.mkv", "b__good.mkv"}
    assert made(Path("out"))["good.mkv"] == before["good.mkv"]
    code, out, _ = run("batch", "measure", "rec/?/good.mkv", *ALONE, "--out", "out")
    assert code == 0
    assert "nothing to do" in out
    assert [line["result"] for line in lines(Path("out"))] == ["good.mkv", "b__good.mkv"]


def test_results_and_recordings_may_move_together(run: Run, copy: Path, tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    shutil.move("rec", "lab/rec")
    run("batch", "measure", "lab/rec/a/*.mkv", *ALONE, "--out", "lab/out")
    Path("lab").rename("archive")
    assert "nothing to do" in run("batch", "measure", "archive/rec/a/*.mkv", *ALONE, "--out", "archive/out")[1]


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("rec/nothing*.mkv", *ALONE), 1, "No file matches rec/nothing*.mkv: check the path"),
        (("rec/a/good.mkv",), 2, "The scale must be given, but is not"),
        (("rec/a/good.mkv", *ALONE, "--roi", "1,2"), 2, "--roi must be four whole numbers"),
        (("rec/a/good.mkv", "--calibration", "nix.json"), 1, "There is no file nix.json"),
        (("rec/a/good.mkv", *SCALE, "--scheduler", "tcp://h:1", "--jobs", "2"), 2, "leave one out"),
        (("rec/b/broken.mkv", *ALONE), 1, "rec/b/broken.mkv must be a video"),
        (("rec/a/good.mkv", *ALONE, "--roi", "0,0,9999,9"), 2, "--roi must lie inside the frame"),
    ],
)
def test_bad_requests_are_a_sentence(
    run: Run, copy: Path, arguments: tuple[str, ...], code: int, sentence: str
) -> None:
    ended, _, err = run("batch", "measure", *arguments, "--out", "out")
    assert ended == code
    assert sentence in err


def test_an_output_folder_of_something_else_is_left_alone(run: Run, copy: Path) -> None:
    Path("mine").mkdir()
    Path("mine/thesis.txt").write_text("years of work", encoding="utf-8")
    code, _, err = run("batch", "measure", "rec/a/good.mkv", *ALONE, "--out", "mine")
    assert code == 1
    assert "--out must be a new folder or that of an earlier batch, but mine contains other files (thesis.txt)" in err
    assert [path.name for path in Path("mine").iterdir()] == ["thesis.txt"]
    code, _, err = run("batch", "measure", "rec/a/good.mkv", *ALONE, "--out", "mine/thesis.txt")
    assert (code, "is a file: name another" in err) == (1, True)
    code, _, err = run("batch", "measure", "rec/**/*.mkv", *ALONE, "--out", "rec")
    assert (code, "--out must not be a folder that contains the inputs" in err) == (2, True)


def test_a_batch_of_another_command_is_left_alone(run: Run, copy: Path) -> None:
    Path("told").mkdir()
    mark = Path("told/batch.json")
    mark.write_text('{"schema": 1, "command": "diagnose"}', encoding="utf-8")
    code, _, err = run("batch", "measure", "rec/a/good.mkv", *ALONE, "--out", "told")
    assert code == 1
    assert "--out must be a folder of `batch measure`, but told was written by `batch diagnose`" in err
    assert [path.name for path in Path("told").iterdir()] == [mark.name]


def test_an_unreadable_file_is_listed(run: Run, copy: Path) -> None:
    # A link to itself cannot be read by anybody, not even by root.
    Path("rec/a/loop.mkv").symlink_to("loop.mkv")
    code, _, err = run("batch", "measure", "rec/a/good.mkv", "rec/a/loop.mkv", "rec/gone.mkv", *ALONE, "--out", "out")
    assert code == 3
    assert [line["exit_code"] for line in lines(Path("out"))] == ["0", "1", "1"]
    assert "rec/gone.mkv" in err


@pytest.mark.slow
def test_tables_are_diagnosed_together(run: Run, tmp_path: Path) -> None:
    sample = Path(__file__).parents[2] / "sample_frames" / "opening"
    Path("good.csv").write_bytes((sample / "expected_gaps.csv").read_bytes())
    header = (sample / "expected_gaps.csv").read_text(encoding="utf-8").splitlines()[0]
    if "input_mm" not in header:
        pytest.skip("the sample's table has no input_mm")
    Path("bad.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    options = ("--model", sample / "simulation.csv", "--without", "lens_distortion", "--out", "out")
    code, _, err = run("batch", "diagnose", "*.csv", *options)
    assert code == 3
    assert "bad.csv must have a column input_mm" in err
    bad, good = lines(Path("out"))
    assert (bad["verdict"], good["verdict"]) == ("", "named")
    assert "backlash" in good["effects"]
    # The model is found from the folder's last place, not from that where it was written.
    assert run("diagnose", "good.csv", "--model", "out/good.csv/model.toml", "--out", "again")[0] == 0


@pytest.fixture
def long_batch(recordings: Path, tmp_path: Path) -> Iterator["subprocess.Popen[str]"]:
    """A batch in the middle of its work: one result is there, others are not."""
    program = [sys.executable, "-m", "fingervision", "batch", "measure", f"{recordings}/*/good*.mkv", *ALONE]
    process = subprocess.Popen(
        [*program, "--out", "out"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    until = time.monotonic() + PATIENCE_S
    while not made(tmp_path / "out") and process.poll() is None and time.monotonic() < until:
        time.sleep(0.005)
    yield process
    process.kill()
    process.wait()


@pytest.mark.slow
@pytest.mark.parametrize("blow", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_batch_that_was_stopped_goes_on(
    run: Run, recordings: Path, tmp_path: Path, long_batch: "subprocess.Popen[str]", blow: signal.Signals
) -> None:
    os.killpg(long_batch.pid, blow)
    _, err = long_batch.communicate(timeout=PATIENCE_S)
    kept = made(tmp_path / "out")
    assert "Traceback" not in err
    if blow is not signal.SIGKILL and long_batch.returncode != 0:
        assert long_batch.returncode == 1
        assert "Stopped by the user" in err
        assert "repeat the command to process the others" in err
    code, out, _ = run("batch", "measure", f"{recordings}/*/good*.mkv", *ALONE, "--out", "out")
    assert code == 0
    assert (f"{4 - len(kept)} processed by this call" if len(kept) < 4 else "nothing to do") in out
    assert {name: made(tmp_path / "out")[name] for name in kept} == kept
    assert not list((tmp_path / "out").glob(".*.part*"))


@pytest.mark.slow
def test_a_full_disk_stops_it_and_loses_nothing(run: Run, copy: Path, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=160k", "tmpfs", str(disk)], capture_output=True, text=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip("a small disk cannot be mounted here")
    try:
        arguments = ("batch", "measure", "rec/*/good*.mkv", *ALONE)
        code, _, err = run(*arguments, "--out", disk / "out")
        assert code == 1
        assert "full" in err or "No space left" in err
        kept = made(disk / "out")
        assert len(kept) < 4
        subprocess.run(["mount", "-o", "remount,size=20m", str(disk)], check=True)
        assert run(*arguments, "--out", disk / "out")[0] == 0
        assert {name: made(disk / "out")[name] for name in kept} == kept
        assert len(made(disk / "out")) == 4
    finally:
        subprocess.run(["umount", str(disk)], check=True)


# A process that dies in any case: test_local_processes.py.
@pytest.mark.slow
def test_a_worker_that_is_killed_costs_nothing(recordings: Path, tmp_path: Path) -> None:
    program = [sys.executable, "-m", "fingervision", "batch", "measure", f"{recordings}/*/good*.mkv", *ALONE]
    running = subprocess.Popen([*program, "--out", "out"], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    owner = None
    until = time.monotonic() + PATIENCE_S
    while owner is None and time.monotonic() < until and running.poll() is None:
        owner = next((int(part.name.split("~")[2]) for part in tmp_path.glob("out/.*.part~*")), None)
        time.sleep(0.001)
    assert owner is not None
    with suppress(ProcessLookupError):  # a busy machine is late to kill: everything is done then
        os.kill(owner, signal.SIGKILL)
    _, err = running.communicate(timeout=PATIENCE_S)
    assert (running.returncode, err) == (0, "")
    assert len(made(tmp_path / "out")) == len(lines(tmp_path / "out")) == 4
    assert not list((tmp_path / "out").glob(".*.part*"))


def test_a_list_states_options_for_each_recording(copy: Path, run: Run, tmp_path: Path) -> None:
    (copy / "runs.csv").write_text(
        "# a day\nrecording,px_per_mm,tips,model\na/good.mkv,40,,none.csv\nb/good.mkv,,up,none.csv\nb/broken.mkv,,,\n"
    )
    code, _, said = run("batch", "measure", "--list", copy / "runs.csv", *ALONE, "--out", "day")
    assert code == 3
    assert "broken.mkv" in said
    first, second, broken = lines(tmp_path / "day")
    alone = [run("measure", copy / name, "--px-per-mm", scale, "--out", out)[0] for name, scale, out in (
        ("a/good.mkv", "40", "one"), ("b/good.mkv", "20", "two"),
    )]  # fmt: skip
    assert alone == [0, 0]
    for row, out in ((first, "one"), (second, "two")):
        folder = tmp_path / "day" / row["result"]
        assert (folder / "gaps.csv").read_bytes() == (tmp_path / out / "gaps.csv").read_bytes()
    assert broken["result"] == ""
    # What was not measured is listed; the others are diagnosed.
    (copy / "none.csv").write_text("input_mm,gap_mm\n0,4\n1,12\n")
    code, _, said = run(
        "batch", "diagnose", "--list", copy / "runs.csv", "--results", "day", "--jobs", "1", "--out", "why"
    )
    assert said.count("must have its gaps") == 1
    assert "broken.mkv must have its gaps" in said
    assert len(lines(tmp_path / "why")) == 3
    code, _, said = run("batch", "diagnose", "--list", copy / "runs.csv", "--out", "other")
    assert (code, "--results" in said) == (1, True)
    # A changed cell repeats that recording alone.
    (copy / "runs.csv").write_text("recording,px_per_mm,tips\na/good.mkv,41,\nb/good.mkv,,up\n")
    code, told, _ = run("batch", "measure", "--list", copy / "runs.csv", *ALONE, "--out", "day")
    assert (code, "1 processed" in told) == (0, True)


@pytest.mark.parametrize(
    ("table", "fact"),
    [
        ("recording,drve\na/good.mkv,x\n", "drive"),
        ("recording,px_per_mm\na/good.mkv,abc\n", "line 2"),
        ("recording\na/good.mkv\na/good.mkv\n", "lines 2 and 3"),
        ("recording,tips\n,up\n", "line 2"),
        ("recording\n", "at least one"),
        ("film\na/good.mkv\n", "film"),
    ],
)
def test_a_wrong_list_is_refused_before_anything_is_written(
    copy: Path, run: Run, tmp_path: Path, table: str, fact: str
) -> None:
    (copy / "runs.csv").write_text(table)
    code, _, said = run("batch", "measure", "--list", copy / "runs.csv", *ALONE, "--out", "day")
    assert (code, fact in said) == (1, True), said
    assert not (tmp_path / "day").exists()


def test_inputs_are_named_one_way(copy: Path, run: Run) -> None:
    for arguments in ((), (copy / "a" / "good.mkv", "--list", copy / "runs.csv")):
        code, _, said = run("batch", "measure", *arguments, *ALONE, "--out", "day")
        assert (code, "--list" in said) == (2, True)
    code, _, said = run("batch", "diagnose", "--list", copy / "runs.csv", "--results", copy / "none", "--out", "why")
    assert code == 1
