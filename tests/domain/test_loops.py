"""The loops in C: built once and found again, refused where they cannot be, and fed with nothing but what they take."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain import loops_build
from fingervision.domain.loops import loop

TOP = Path(__file__).resolve().parents[2]
USE = """
import numpy as np
from fingervision.domain.loops import loop
print(loop("median_middle")(np.array([3.0, 1.0, 2.0])))
"""


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A package of three files that has one loop, without a library."""
    domain = tmp_path / "fingervision" / "domain"
    domain.mkdir(parents=True)
    for name in ("loops.py", "loops_build.py", "loops.c", "loops.h", "errors.py", "__init__.py"):
        (domain / name).write_bytes((TOP / "fingervision" / "domain" / name).read_bytes())
    (tmp_path / "fingervision" / "__init__.py").touch()
    (domain / "median.c").write_bytes((TOP / "fingervision" / "vision" / "median.c").read_bytes())
    return tmp_path


def _use(folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "PYTHONDONTWRITEBYTECODE": "1",
        "XDG_CACHE_HOME": str(folder / "cache"),
        **variables,
    }
    command = [sys.executable, "-c", USE]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment, cwd=folder)


def _built(folder: Path) -> list[Path]:
    return sorted(folder.rglob("_loops-*"))


def test_it_is_built_once_and_anew_when_a_source_has_changed(copied: Path) -> None:
    (copied / "pyproject.toml").touch()
    assert _use(copied).stdout == "2.0\n"
    (first,) = _built(copied)
    assert _use(copied, CC="no-such-compiler").stdout == "2.0\n"
    assert first.parents[1] == copied / "build" / "loops"
    source = copied / "fingervision" / "domain" / "median.c"
    source.write_text(source.read_text().replace("wanted = n / 2", "wanted = 0"))
    assert _use(copied).stdout == "1.0\n"
    (second,) = _built(copied)
    assert second.name != first.name


def test_where_the_package_cannot_be_written_to_it_is_kept_in_the_users_cache(copied: Path) -> None:
    (copied / "pyproject.toml").write_text("")
    # A file stands where the folder would be: root could write to any folder.
    (copied / "build").write_text("")
    assert _use(copied).stdout == "2.0\n"
    assert [path.parents[1] for path in _built(copied)] == [copied / "cache" / "fingervision"]
    (copied / "none").write_text("")
    (copied / "pyproject.toml").unlink()
    shutil.rmtree(copied / "cache")
    done = _use(copied, XDG_CACHE_HOME=str(copied / "none"))
    assert "can be written to" in done.stderr


def test_without_a_compiler_a_sentence_says_what_to_do(copied: Path) -> None:
    done = _use(copied, CC="", PATH="")
    assert "C compiler" in done.stderr
    assert "pip install" in done.stderr
    done = _use(copied, CC="false")
    assert "failed on the loops" in done.stderr


def test_a_constant_of_the_python_file_is_the_loops_own() -> None:
    found = loops_build.constants(TOP / "fingervision" / "vision" / "profile_lines.py")
    assert (found["ROWS"], found["PLACES"], found["SLOPE_OF_A_TIP"]) == (92, 168, 0.999)
    assert loops_build.constants(TOP / "fingervision" / "vision" / "finger_shape.py")["TOP_M"] == 7


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros(4, dtype=np.float32), "format f"),
        (np.zeros((4, 4))[:, 1], "not contiguous"),
        (np.zeros(4, dtype=np.int64), "format l"),
        ([1.0, 2.0], "list"),
        (np.zeros((1, 1, 1, 1)), "4 axes"),
        (None, "NoneType"),
    ],
)
def test_what_a_loop_does_not_take_is_refused(array: object, words: str) -> None:
    with pytest.raises((TypeError, BufferError), match=words):
        loop("median_middle")(array)


def test_arguments_are_counted_and_numbers_are_numbers() -> None:
    run = loop("edge_filters_row")
    assert run(1.0, 50) == run(np.float64(1.0), np.int64(50))
    with pytest.raises(TypeError, match="takes 2 arguments, but got 1"):
        run(1.0)
    with pytest.raises(TypeError):
        run("1.0", 50)
    with pytest.raises(TypeError):
        run(1.0, 2.5)


def test_what_is_written_to_must_not_be_read_only() -> None:
    out = np.zeros(3)
    out.flags.writeable = False
    with pytest.raises(ValueError, match="read-only"):
        loop("stick_slip_stick")(np.zeros(3), 0.1, out)


def test_sums_are_taken_in_turn() -> None:
    """Each small number is lost beside the large one before it; vectors would add them to each other first."""
    values = np.tile([1e16, 1.0, -1e16, 1.0], 64)
    one, n = np.ones(values.size), values.size
    intercept, slope = loop("first_guess_line")(one, values)
    assert slope == 0.0
    assert intercept == np.cumsum(values)[-1] / n


def test_a_picture_may_be_seen_from_any_side() -> None:
    picture = np.arange(12, dtype=np.uint8).reshape(3, 4)
    for view in (picture, picture.T, picture[::-1], picture[:, ::-1].T, picture[::2, 1::2]):
        count = np.empty(256, dtype=np.int64)
        loop("binarise_histogram")(view, count)
        assert np.array_equal(count, np.bincount(view.ravel(), minlength=256))
    deep = (picture.astype(np.uint16) * 300)[::-1]
    count = np.empty(4096, dtype=np.int64)
    loop("binarise_histogram")(deep, count)
    assert np.array_equal(count, np.bincount(deep.ravel(), minlength=4096))
