"""What is handed out: one version everywhere, a wheel and an sdist that install and work by themselves."""

import os
import re
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

from fingervision import __version__

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def run(*command: str | Path, cwd: Path) -> str:
    # Nothing of this checkout may help: no path to it, and another folder.
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")}
    words = [str(part) for part in command]
    done = subprocess.run(words, cwd=cwd, env=clean, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def test_one_version_everywhere() -> None:
    assert PROJECT["version"] == __version__
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(r"^version: (.+)$", citation, re.MULTILINE)[1] == __version__  # type: ignore[index]
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.search(r"^date-released: (.+)$", citation, re.MULTILINE)
    assert released is not None
    assert f"## [{__version__}] - {released[1]}\n" in changelog


def test_the_changelog_is_kept_as_such() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## (.+)$", changelog, re.MULTILINE)
    assert headings[0] == "[Unreleased]"
    assert all(re.fullmatch(r"\[\d+\.\d+\.\d+\] - \d{4}-\d{2}-\d{2}", heading) for heading in headings[1:])
    kinds = set(re.findall(r"^### (.+)$", changelog, re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


@pytest.mark.slow
def test_wheel_and_sdist_are_whole_and_the_wheel_works_alone(tmp_path: Path) -> None:
    pytest.importorskip("build")
    pytest.importorskip("twine")
    dist = tmp_path / "dist"
    # The environment has what builds: without isolation nothing is fetched for it.
    flags = ["--no-isolation"] if find_spec("hatchling") else []
    run(sys.executable, "-m", "build", *flags, "--outdir", dist, ROOT, cwd=tmp_path)
    (wheel,) = dist.glob("*.whl")
    (sdist,) = dist.glob("*.tar.gz")
    # The loops in C are built for one kind of machine, for every Python from 3.11 on.
    assert wheel.name.startswith(f"fingervision-{__version__}-cp311-abi3-")
    assert "PASSED" in run(sys.executable, "-m", "twine", "check", "--strict", wheel, sdist, cwd=tmp_path)
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {name.split("/")[0] for name in names} == {"fingervision", "calib", f"fingervision-{__version__}.dist-info"}
    assert any(name.startswith("fingervision/domain/_loops-") for name in names)
    for needed in ("fingervision/py.typed", "fingervision/live/page/index.html", "fingervision/testbed/simulated.toml"):
        assert needed in names
    with tarfile.open(sdist) as archive:
        inside = {name.split("/", 1)[1] for name in archive.getnames() if "/" in name}
    for needed in (
        "LICENSE",
        "CHANGELOG.md",
        "CITATION.cff",
        "docs/index.md",
        "tests/test_house.py",
        "fingervision/domain/loops.h",
    ):
        assert needed in inside

    bare = tmp_path / "bare"
    venv.create(bare, with_pip=True)
    programs = bare / ("Scripts" if os.name == "nt" else "bin")
    # Compiling to bytecode what is imported is left to the import: half of the time of an installation.
    run(programs / "python", "-m", "pip", "install", "--quiet", "--no-compile", wheel, cwd=tmp_path)
    fingervision = programs / ("fingervision.exe" if os.name == "nt" else "fingervision")
    assert run(fingervision, "--version", cwd=tmp_path).strip().endswith(__version__)
    assert "measure" in run(fingervision, "--help", cwd=tmp_path)
    # Far from this checkout: the samples come with the wheel.
    run(fingervision, "example", "measure", "--out", "trial", cwd=tmp_path)
    run(fingervision, "example", "paper", "--out", "paper", cwd=tmp_path)
    (frames,) = (path.parent for path in (tmp_path / "paper").rglob("frame_00.png"))
    said = run(fingervision, "measure", frames, "--px-per-mm", "34", "--out", "measured", cwd=tmp_path)
    assert "17 of 17 frames measured" in said
    assert len((tmp_path / "measured" / "gaps.csv").read_text(encoding="utf-8").splitlines()) == 18
