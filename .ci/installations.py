"""Install the built wheel under every supported Python and at the oldest dependencies; run the first commands there.

    python3 .ci/installations.py [--tests]

Each row of the printed table is a fresh environment outside the checkout. Pythons that the machine does not have are
skipped, with the reason. With `--tests`, the fast tests are run in each environment as well (some minutes each). The
exit code is 1 if a row failed. Only the standard library is used, because nothing is installed yet.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# The oldest one is `requires-python`; a newer Python than the last one here has not been released.
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
SAMPLE = ROOT / "sample_frames" / "opening"
# Hidden in the sample: a play of 0.03 mm (sample_frames/opening/NOTE.md).
HIDDEN, TRUE_PLAY_MM = "backlash", 0.03


def main() -> int:
    """Print the table; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tests", action="store_true", help="run the fast tests in each environment as well")
    tests = parser.parse_args().tests
    failed = False
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel = _wheel(folder)
        # Two at a time, because an installation waits for downloads; tests of live views need all of the machine.
        with ThreadPoolExecutor(1 if tests else 2) as pool:
            for line, has_failed in pool.map(lambda row: _row(folder, wheel, tests, *row), _rows(folder)):
                print(line, flush=True)
                failed |= has_failed
    return failed


def _row(
    folder: Path, wheel: Path, tests: bool, version: str, python: Path | None, constraints: Path | None
) -> tuple[str, bool]:
    """The line of the table for one environment, and whether it failed."""
    label = f"Python {version}, {'oldest' if constraints else 'newest'} dependencies"
    if python is None:
        return f"{label}: skipped, because this machine has no python{version}", False
    try:
        return f"{label}: {_tried(folder / label.replace(' ', '_'), python, wheel, constraints, tests)}", False
    except (subprocess.CalledProcessError, AssertionError) as error:
        return f"{label}: FAILED, {error}\n{getattr(error, 'stdout', '')}", True


def oldest_versions() -> list[str]:
    """Constraints by which pip takes the lowest version that `pyproject.toml` admits of each dependency."""
    names = [re.match(r"([\w.-]+)>=([\w.]+)", line) for line in PROJECT["dependencies"]]
    if None in names:
        msg = "Every dependency in pyproject.toml must state a lower bound as NAME>=VERSION, but one does not."
        raise ValueError(msg)
    return [f"{found[1]}=={found[2]}" for found in names if found]


def _rows(folder: Path) -> Iterator[tuple[str, Path | None, Path | None]]:
    constraints = folder / "oldest.txt"
    constraints.write_text("\n".join(oldest_versions()), encoding="utf-8")
    for version in PYTHONS:
        yield version, _python(version), None
    yield PYTHONS[0], _python(PYTHONS[0]), constraints


def _python(version: str) -> Path | None:
    """A Python of a version: on the path, or installed by pyenv; None if there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    on_path = [shutil.which(name) for name in (f"python{version}", "python3", "python")]
    for found in [*(Path(each) for each in on_path if each), *sorted(pyenv.glob(f"{version}.*/bin/python"))]:
        # A shim of pyenv is on the path even if its version is not chosen.
        asked = [found, "-c", "import sys; print('{}.{}'.format(*sys.version_info))"]
        if subprocess.run(asked, capture_output=True, text=True, check=False).stdout.strip() == version:
            return found
    return None


def _wheel(folder: Path) -> Path:
    _run(folder, sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", folder, ROOT)
    (wheel,) = folder.glob("*.whl")
    return wheel


def _tried(folder: Path, python: Path, wheel: Path, constraints: Path | None, tests: bool) -> str:
    """Install, measure and diagnose the sample; return what was seen."""
    folder.mkdir()
    _run(folder, python, "-m", "venv", folder / "env")
    programs = folder / "env" / ("Scripts" if os.name == "nt" else "bin")
    bounded = ["--constraint", constraints] if constraints else []
    what = f"fingervision[test] @ {wheel.as_uri()}" if tests else wheel
    _install(folder, programs / "python", *bounded, what)
    program = programs / "fingervision"
    scale = ["--calibration", SAMPLE / "calibration.json", "--drive", SAMPLE / "drive.csv"]
    _run(folder, program, "measure", SAMPLE / "opening.mp4", *scale, "--out", "measured")
    _run(folder, program, "diagnose", "measured/gaps.csv", "--model", SAMPLE / "simulation.csv", "--out", "diagnosed")
    report = json.loads((folder / "diagnosed" / "report.json").read_text(encoding="utf-8"))
    named = [effect["name"] for effect in report["effects"]]
    assert (report["verdict"], named) == ("named", [HIDDEN]), f"{report['verdict']}: {named}"
    play = report["effects"][0]["parameters"]["play_mm"]
    assert abs(play["value"] - TRUE_PLAY_MM) < 3 * play["u"], play
    # Units of foreign tables need a library that nothing else loads.
    (folder / "foreign.csv").write_text("Zeit [s];Weg [um];Spalt [mm]\n0,0;0,0;1,25\n0,1;10,0;1,35\n", encoding="utf-8")
    assert "um" in _run(folder, program, "table", "foreign.csv")
    seen = f"measured, named {HIDDEN} {play['value']:.5f} mm"
    if tests:
        said = _run(
            ROOT, programs / "python", "-m", "pytest", "-q", "-n", "auto", *(["-W", "default"] if constraints else [])
        )
        seen += f"; tests: {said.strip().splitlines()[-1]}"
    return seen


def _install(folder: Path, python: Path, *what: str | Path) -> None:
    """Install into the environment of a Python: with uv where this Python has it, which takes a tenth of pip's time."""
    if find_spec("uv"):
        _run(folder, sys.executable, "-m", "uv", "pip", "install", "--quiet", "--python", python, *what)
    else:
        _run(folder, python, "-m", "pip", "install", "--quiet", "--no-compile", *what)


def _run(folder: Path, *command: str | Path) -> str:
    """Run a program in a folder without any help of this checkout; return what it printed."""
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")}
    words = [str(word) for word in command]
    return subprocess.run(
        words,
        cwd=folder,
        env=clean,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        check=True,
    ).stdout


if __name__ == "__main__":
    sys.exit(main())
