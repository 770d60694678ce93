"""Recordings that the tests of batches share."""

import multiprocessing
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.rendering import Camera, render, two_fingers
from tests.clips import FFV1, write_clip

PX_PER_MM = 20.0
WORK = ["cv2", "av", "matplotlib.pyplot", "fingervision.cli.measure", "fingervision.cli.diagnose"]


@pytest.fixture(autouse=True)
def _workers_that_start_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers are forked from a process that has loaded the program; batches in processes of their own start theirs."""
    server = multiprocessing.get_context("forkserver")
    server.set_forkserver_preload(WORK)
    monkeypatch.setattr("fingervision.batch.local_processes.multiprocessing.get_context", lambda method: server)


def frames(count: int, seed: int) -> Iterator[Frame]:
    rng = np.random.default_rng(seed)
    for k in range(count):
        gap_px = 60.0 + 2.0 * k + 3.0 * seed
        scene = two_fingers(gap_px, below_tip_px=0.3 * PX_PER_MM, width_px=40.0, frame=(240, 200))
        yield Frame(render(scene, Camera(blur_px=0.9, noise_grey=1.0), rng), k, 0.04 * k)


@pytest.fixture(scope="session")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four good recordings, two of them of one name, and one that is none."""
    folder = tmp_path_factory.mktemp("recordings")
    for seed, name in enumerate(("a/good.mkv", "b/good.mkv", "b/good_too.mkv", "c/good_last.mkv")):
        (folder / name).parent.mkdir(exist_ok=True)
        write_clip(folder / name, frames(12, seed), FFV1)
    (folder / "b" / "broken.mkv").write_bytes(b"this is not a video")
    return folder
