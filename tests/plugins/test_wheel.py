"""A plug-in's wheel installed with that of the project: `diagnose` names its effect, and `bed run` drives its stage."""

import csv
import importlib.util
import json
import os
import site
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.plugins.installed import effect_source

ROOT = Path(__file__).parents[2]
PYPROJECT = """
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"
[project]
name = "fv-screw-bend"
version = "1.2"
dependencies = ["fingervision"]
[project.entry-points."fingervision.effects"]
screw_bend = "fv_screw_bend.effect"
[project.entry-points."fingervision.actuators"]
their_stage = "fv_screw_bend.stage"
[tool.hatch.build.targets.wheel]
packages = ["fv_screw_bend"]
"""
BED = """
schema = 1
[actuator]
kind = "their_stage"
[camera]
kind = "simulated"
[gripper]
[scale]
px_per_mm = 34.0
"""
RECIPE = """
schema = 1
name = "there and back, twice"
[[step]]
kind = "triangle"
from_mm = -0.4
to_mm = 1.3
speed_mm_s = 0.7
cycles = 2
"""


def built(source: Path, out: Path) -> Path:
    """Build a wheel, without network access if the build backend is installed."""
    isolation = ["--no-build-isolation"] if importlib.util.find_spec("hatchling") else []
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", *isolation, "-w", str(out), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip(f"no wheel can be built here: {done.stderr.strip().splitlines()[-1]}")
    (wheel,) = out.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the command in an environment with both wheels, which uses the libraries of the present environment."""
    if importlib.util.find_spec("pip") is None:
        pytest.skip("pip is not here")
    folder = tmp_path_factory.mktemp("wheels")
    plugin = folder / "plugin"
    (plugin / "fv_screw_bend").mkdir(parents=True)
    (plugin / "pyproject.toml").write_text(PYPROJECT, encoding="utf-8")
    (plugin / "fv_screw_bend" / "__init__.py").write_text("", encoding="utf-8")
    (plugin / "fv_screw_bend" / "effect.py").write_text(effect_source(), encoding="utf-8")
    stage = (Path(__file__).parent / "stage.py").read_text(encoding="utf-8")
    (plugin / "fv_screw_bend" / "stage.py").write_text(stage, encoding="utf-8")
    wheels = [built(ROOT, folder / "ours"), built(plugin, folder / "theirs")]
    venv = folder / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(venv)], check=True)
    python = venv / ("Scripts" if os.name == "nt" else "bin") / "python"
    place = Path(sysconfig.get_path("purelib", vars={"base": str(venv), "platbase": str(venv)}))
    install = [sys.executable, "-m", "pip", "--quiet", "--python", str(python), "install", "--no-deps", "--no-index"]
    subprocess.run([*install, *map(str, wheels)], check=True, capture_output=True)
    libraries = sorted({*site.getsitepackages(), sysconfig.get_path("purelib"), sysconfig.get_path("platlib")})
    (place / "libraries.pth").write_text("\n".join(libraries) + "\n", encoding="utf-8")
    return python


def call(python: Path, folder: Path, *words: str) -> str:
    """Run the command in a folder outside the sources."""
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    command = [str(python), "-m", "fingervision", *words]
    done = subprocess.run(command, cwd=folder, env=clean, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_a_plug_in_wheel_beside_the_projects(installed: Path, tmp_path: Path) -> None:
    listed = call(installed, tmp_path, "effects")
    (line,) = [line for line in listed.splitlines() if line.startswith("screw_bend")]
    assert line.endswith("[fv-screw-bend 1.2]")
    where = call(installed, tmp_path, "plugins")
    assert "their_stage" in where

    (tmp_path / "bed.toml").write_text(BED, encoding="utf-8")
    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    hidden = "screw_bend:bend_per_mm2=0.03"
    call(installed, tmp_path, "bed", "run", "recipe.toml", "--bed", "bed.toml", "--hide", hidden, "--out", "run")
    with (tmp_path / "run" / "samples.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    inputs = [float(row["input_mm"]) for row in rows if row["input_mm"]]
    assert max(inputs) == pytest.approx(1.3, abs=0.03)
    assert "stage of a plug-in" in (tmp_path / "run" / "run.json").read_text(encoding="utf-8")

    call(installed, tmp_path, "diagnose", "run/samples.csv", "--model", "run/simulation.csv", "--out", "answer")
    report = json.loads((tmp_path / "answer" / "report.json").read_text(encoding="utf-8"))
    (named,) = report["effects"]
    assert named["name"] == "screw_bend"
    bend = named["parameters"]["bend_per_mm2"]
    assert abs(bend["value"] - 0.03) < 4.0 * bend["u"]
    assert ["screw_bend"] in report["alternatives"]
    page = (tmp_path / "answer" / "report.html").read_text(encoding="utf-8")
    assert "screw_bend" in page
