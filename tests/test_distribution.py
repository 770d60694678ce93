"""What is handed out: one version everywhere, a wheel and an sdist that install and work by themselves."""

import os
import re
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path
from types import SimpleNamespace

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


@pytest.mark.parametrize("repository", [None, "https://example.org/name/fingervision/"])
def test_the_page_of_an_index_has_no_dead_link(repository: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    # The hooks alone, without hatchling.
    for name, hook in (("builders.hooks", "BuildHookInterface"), ("metadata", "MetadataHookInterface")):
        monkeypatch.setitem(sys.modules, f"hatchling.{name}.plugin.interface", SimpleNamespace(**{hook: object}))
    hooks = runpy.run_path(str(ROOT / ".ci" / "hatch_build.py"))
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    page = hooks["index_page"](readme, repository, "1.2.3")
    targets = re.findall(r"\]\(([^)]*)\)", page)
    assert all(target.startswith("https://") for target in targets)
    if repository is None:
        assert "![" not in page
        assert "The first tutorial explains" in page
        return
    assert len(targets) == len(re.findall(r"\]\(([^)]*)\)", readme))
    assert f"({repository}raw/v1.2.3/sample_frames/opening/idea.png)" in page
    assert f"({repository}blob/v1.2.3/CHANGELOG.md)" in page


def other_pythons() -> list[str]:
    """Every supported Python of this machine that starts: pyenv also puts names of inactive ones on the path."""
    versions = ("3.11", "3.12", "3.13", "3.14")
    found = [str(path) for version in versions for path in Path.home().glob(f".pyenv/versions/{version}.*/bin/python")]
    found += [path for version in versions if (path := shutil.which(f"python{version}"))]
    return [one for one in found if subprocess.run([one, "-c", ""], capture_output=True, check=False).returncode == 0]


LOAD = """
import array, sys
from importlib import machinery, util
loader = machinery.ExtensionFileLoader("_loops", sys.argv[1])
module = util.module_from_spec(util.spec_from_file_location("_loops", sys.argv[1], loader=loader))
loader.exec_module(module)
print(module.median_middle(array.array("d", [3.0, 1.0, 2.0])))
try:
    module.median_middle(array.array("f", [3.0]))
except TypeError as error:
    print(error)
"""


@pytest.mark.slow
def test_wheel_and_sdist_are_whole_and_the_wheel_works_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dist = tmp_path / "dist"
    if sys.platform == "linux":
        monkeypatch.setenv("DIST", str(dist))
        run(ROOT / ".ci" / "release", "linux_x86_64", cwd=tmp_path)
    else:
        pytest.importorskip("build")
        run(sys.executable, "-m", "build", "--outdir", dist, ROOT, cwd=tmp_path)
    (wheel,) = dist.glob("*.whl")
    (sdist,) = dist.glob("*.tar.gz")
    # The loops in C are built for one kind of machine, for every Python from 3.11 on.
    assert wheel.name.startswith(f"fingervision-{__version__}-cp311-abi3-")
    if sys.platform == "linux":
        assert "manylinux_2_17_x86_64" in wheel.name
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (library,) = (name for name in names if name.startswith("fingervision/domain/_loops-"))
        archive.extract(library, tmp_path)
    for python in (sys.executable, *other_pythons()):
        answer = run(python, "-c", LOAD, tmp_path / library, cwd=tmp_path)
        assert answer.startswith("2.0\nmedian_middle: argument 1"), python
    assert {name.split("/")[0] for name in names} == {"fingervision", "calib", f"fingervision-{__version__}.dist-info"}
    for needed in ("fingervision/py.typed", "fingervision/live/page/index.html", "fingervision/testbed/simulated.toml"):
        assert needed in names
    with tarfile.open(sdist) as archive:
        inside = {name.split("/", 1)[1] for name in archive.getnames() if "/" in name}
    for needed in (
        "LICENSE",
        "CHANGELOG.md",
        "CITATION.cff",
        "docs/index.md",
        ".ci/release",
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
