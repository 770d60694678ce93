"""A real Dask scheduler with real workers on loopback: the same results, also when a worker is killed."""

import csv
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="Dask is not installed: pip install -e '.[cluster]'")

import calib
from fingervision.batch import cluster as cluster_module
from fingervision.cli import main
from fingervision.domain.errors import FingervisionError
from tests.waiting import free_port

ROOT = Path(__file__).parents[2]
# Starting Python, Dask and our imports on a busy machine; nothing is measured by it.
PATIENCE_S = 90.0
SCALE = ("--px-per-mm", "20")
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
    # Workers are called dead soon enough for a test.
    "DASK_DISTRIBUTED__DEPLOY__LOST_WORKER_TIMEOUT": "1s",
}


def started(folder: Path, *arguments: str) -> "subprocess.Popen[bytes]":
    program = [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]]
    return subprocess.Popen(program, cwd=folder, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def worker(folder: Path, address: str) -> "subprocess.Popen[bytes]":
    options = ("--host", "127.0.0.1", "--nthreads", "1", "--no-dashboard", "--no-nanny")
    return started(folder, "dask_worker", address, *options, "--local-directory", str(folder))


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, "list[subprocess.Popen[bytes]]"]]:
    """One cluster for all, with a worker: who needs a second one starts it, and who kills a worker comes last."""
    tmp_path = tmp_path_factory.mktemp("cluster")
    address = f"tcp://127.0.0.1:{free_port()}"
    host, port = "127.0.0.1", address.rpartition(":")[2]
    scheduler = started(tmp_path, "dask_scheduler", "--host", host, "--port", port, "--no-dashboard")
    workers = [worker(tmp_path, address)]
    try:
        yield address, workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


def batch(folder: Path, *arguments: object) -> "subprocess.CompletedProcess[str]":
    program = [sys.executable, "-m", "fingervision", "batch", "measure", *map(str, arguments)]
    return subprocess.run(program, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False)


def lines(out: Path) -> list[dict[str, str]]:
    return list(csv.DictReader((out / "batch.csv").read_text(encoding="utf-8").splitlines()))


def wait_for_workers(address: str, count: int) -> None:
    from distributed import Client

    with Client(address, timeout=PATIENCE_S, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=PATIENCE_S)


def test_a_scheduler_that_does_not_answer_is_said() -> None:
    assert cluster_module.PATIENCE_S == 10
    address = f"tcp://127.0.0.1:{free_port()}"
    with (
        pytest.raises(
            FingervisionError, match=f"must answer within 0.5 s, but {address} does not: start `dask scheduler`"
        ),
        cluster_module.connected(address, patience_s=0.5),
    ):
        pass


def test_workers_of_another_version_are_refused(
    cluster: tuple[str, "list[subprocess.Popen[bytes]]"],
    recordings: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    wait_for_workers(cluster[0], 1)
    # The same code but for one comment: a copy of which the workers know nothing.
    copy = Path(shutil.copytree(ROOT / "calib", tmp_path / "calib"))
    with (copy / "limits.py").open("a", encoding="utf-8") as file:
        file.write("# Changed.\n")
    monkeypatch.setattr(calib, "__file__", str(copy / "__init__.py"))
    cluster_module.versions.cache_clear()
    asked = ["fingervision", "batch", "measure", f"{recordings}/**/*.mkv", *SCALE, "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", [*asked, "--scheduler", cluster[0]])
    with pytest.raises(SystemExit) as ended:
        main()
    cluster_module.versions.cache_clear()
    said = capsys.readouterr().err
    assert ended.value.code == 1
    assert "Every worker must have the versions that are installed here, but tcp://127.0.0.1:" in said
    assert "source of fingervision" in said
    assert "Traceback" not in said
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_cluster_gives_the_same_and_survives_a_dead_worker(
    cluster: tuple[str, "list[subprocess.Popen[bytes]]"], recordings: Path, tmp_path: Path
) -> None:
    address, workers = cluster
    workers.append(worker(tmp_path, address))
    wait_for_workers(address, 2)
    here, there = tmp_path / "here", tmp_path / "there"
    assert batch(tmp_path, f"{recordings}/**/*.mkv", *SCALE, "--out", here).returncode == 3
    program = [sys.executable, "-m", "fingervision", "batch", "measure", f"{recordings}/**/*.mkv", *SCALE]
    running = subprocess.Popen(
        [*program, "--out", str(there), "--scheduler", address], cwd=tmp_path, env=ENVIRONMENT, stderr=subprocess.PIPE
    )
    # The first part that appears says that a worker is in the middle of a recording.
    until = time.monotonic() + PATIENCE_S
    victim = None
    while victim is None and time.monotonic() < until and running.poll() is None:
        owners = {int(part.name.split("~")[2]) for part in there.glob(".*.part~*")} if there.exists() else set()
        victim = next((worker for worker in workers if worker.pid in owners), None)
        time.sleep(0.002)
    assert victim is not None, running.communicate()
    victim.send_signal(signal.SIGKILL)
    victim.wait()
    _, err = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 3, err.decode()
    assert [line["input"] for line in lines(there)] == [line["input"] for line in lines(here)]
    assert len({line["input"] for line in lines(there)}) == len(lines(there))
    for line in lines(here):
        for name in ("gaps.csv", "gap.png") if line["result"] else ():
            assert (there / line["result"] / name).read_bytes() == (here / line["result"] / name).read_bytes()
    assert not list(there.glob(".*"))
    again = batch(tmp_path, f"{recordings}/**/good*.mkv", *SCALE, "--out", there, "--scheduler", address)
    assert again.returncode == 0, again.stderr
    assert "(0 processed by this call)" in again.stdout or "nothing to do" in again.stdout
