"""Machine code is kept where it can be, thrown away when it is old, and made all the same where it cannot be kept."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled_as_written

HELPER = """
from fingervision.domain.compiled import compiled


@compiled
def helper(x: float) -> float:
    return FACTOR * x
"""
USER = """
from fingervision.domain.compiled import compiled
from kept.helper import helper


@compiled
def user(x: float) -> float:
    return helper(x)
"""
RUN = "from kept.user import user; print(user(1.0), sum(user.stats.cache_hits.values()))"


def _package(folder: Path, factor: float) -> None:
    package = folder / "kept"
    package.mkdir(exist_ok=True)
    (package / "helper.py").write_text(HELPER.replace("FACTOR", str(factor)))
    (package / "user.py").write_text(USER)


def _run(folder: Path, **variables: str) -> list[str]:
    top = Path(__file__).resolve().parents[2]
    path = f"{folder}{os.pathsep}{top}"
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", **variables}
    done = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, check=True, env=environment)
    return done.stdout.split()


def test_what_another_file_compiled_is_not_used_once_that_file_has_changed(tmp_path: Path) -> None:
    _package(tmp_path, 2.0)
    assert _run(tmp_path) == ["2.0", "0"]
    assert _run(tmp_path) == ["2.0", "1"]
    (tmp_path / "kept" / "helper.py").write_text(HELPER.replace("FACTOR", "3.0"))
    assert _run(tmp_path) == ["3.0", "0"]


def test_without_a_place_to_keep_it_machine_code_is_made_anew(tmp_path: Path) -> None:
    _package(tmp_path, 2.0)
    # A file stands where the folder for what is kept would be: beside the source, and in the user's cache.
    (tmp_path / "kept" / "__pycache__").write_text("")
    (tmp_path / "home").write_text("")
    home = str(tmp_path / "home")
    for _ in range(2):
        assert _run(tmp_path, HOME=home, XDG_CACHE_HOME=home, LOCALAPPDATA=home, NUMBA_CACHE_DIR="") == ["2.0", "0"]


@compiled_as_written
def in_turn(values: NDArray[np.float64]) -> float:
    total = 0.0
    for value in values:
        total += value
    return total


def test_what_is_compiled_as_written_takes_its_sums_in_turn() -> None:
    # Each small number is lost beside the large one before it; vectors would add them to each other first.
    values = np.tile([1e16, 1.0, -1e16, 1.0], 64)
    assert in_turn(values) == float(np.cumsum(values)[-1])


def test_what_another_process_has_just_thrown_away_does_not_matter(tmp_path: Path) -> None:
    _package(tmp_path, 2.0)
    assert _run(tmp_path) == ["2.0", "0"]
    (found,) = (tmp_path / "kept" / "__pycache__").glob("user.user-*.nbi")
    # It is listed, and gone when it is looked at.
    found.with_name(found.name.replace("user-", "gone-")).symlink_to(tmp_path / "nowhere")
    assert _run(tmp_path) == ["2.0", "1"]
