"""Stages, cameras and models of other distributions and of files; also frame sources and report sections."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from fingervision.cli import cli
from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.frames.source import Wish
from fingervision.frames.source_kinds import open_source
from fingervision.models.kinds import build_model, kinds
from fingervision.plugins.faults import PluginShapeError
from fingervision.testbed.bed_factory import open_bed
from tests.plugins.installed import install

STAGE = (Path(__file__).parent / "stage.py").read_text(encoding="utf-8")
BED = """
schema = 1
[actuator]
kind = "KIND"
upper_mm = 3.0
[camera]
kind = "simulated"
[gripper]
[scale]
px_per_mm = 34.0
"""
RECIPE = """
schema = 1
name = "there and back"
[[step]]
kind = "triangle"
from_mm = 0.0
to_mm = 0.5
speed_mm_s = 0.5
"""
SPRING = """
import numpy as np
from fingervision.domain.response import Response
from fingervision.models.answer_figures import ModelFigures

KIND = "one_spring"

class OneSpring:
    name = KIND
    input_range_mm = (-0.4, 1.4)
    def __init__(self, gripper):
        self.rest_gap_mm = gripper.body.rest_gap_mm
    def respond(self, input_mm):
        right = 0.5 * (self.rest_gap_mm + 7.7 * np.asarray(input_mm))
        return Response(-right, right, 2.0 * np.asarray(input_mm))
    def figures(self):
        return ModelFigures(7.7, 2.0)

def build(gripper, physics, theory):
    return OneSpring(gripper)
"""
SOURCE = """
import numpy as np
from fingervision.domain.frame import Coding, Frame
from fingervision.frames.source import Description

class Ramps:
    description = Description("ramps", "made up", "none", Coding.LOSSLESS, 32, 24, None, False, 3)
    def __iter__(self):
        return iter([])

def accepts(name):
    return name.startswith("ramps:") or name.endswith(".ramp")

def open_frames(name, wish):
    return Ramps()
"""


def run(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words))


def bed_at(folder: Path, kind: str) -> Path:
    path = folder / "bed.toml"
    path.write_text(BED.replace("KIND", kind), encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_stage_in_a_file_beside_the_bed_is_driven_by_a_recipe(tmp_path: Path) -> None:
    (tmp_path / "their_stage.py").write_text(STAGE, encoding="utf-8")
    bed = bed_at(tmp_path, "./their_stage.py")
    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    out = tmp_path / "run"
    done = run("bed", "run", str(tmp_path / "recipe.toml"), "--bed", str(bed), "--out", str(out))
    assert done.exit_code == 0, (done.output, done.exception)
    rows = np.genfromtxt(out / "samples.csv", delimiter=",", names=True, comments="#")
    assert np.nanmax(rows["input_mm"]) == pytest.approx(0.5, abs=0.02)
    assert "stage of a plug-in" in (out / "run.json").read_text()


def test_an_installed_stage_is_found_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, monkeypatch, {"fingervision.actuators": {"their_stage": "fvdemo_stage"}}, {"fvdemo_stage": STAGE})
    bed = open_bed(str(bed_at(tmp_path, "their_stage")))
    try:
        assert bed.actuator.name == "stage of a plug-in"
        assert bed.limits.upper_mm == 3.0
    finally:
        bed.close()
    assert "fv-demo 1.2" in run("plugins").output
    listed = json.loads(run("plugins", "--json").output)["parts"]
    assert {"group": "fingervision.actuators", "name": "simulated", "from": "built in", "built_in": True} in listed


@pytest.mark.parametrize(
    ("source", "fact"),
    [
        ("KEYS = ()", "build"),
        ("import no_such_driver", "no_such_driver"),
        (STAGE.replace("def stop(self)", "def halt(self)"), "stop"),
        (STAGE.replace("        return (Reading(", "        return list((Reading("), "readings"),
        (STAGE.replace("StageLimits(-1.0, upper_mm, 20.0, 5.0)", "(-1.0, upper_mm)"), "StageLimits"),
        (STAGE.replace('KEYS = ("upper_mm",)', 'KEYS = ["upper_mm"]'), "KEYS"),
        (STAGE.replace("    return Stage(", "    raise OSError('no port')\n    return Stage("), "no port"),
        (STAGE.replace('KEYS = ("upper_mm",)', "KEYS = ()"), "upper_mm"),
    ],
)
def test_a_bad_stage_is_refused_by_its_name(tmp_path: Path, source: str, fact: str) -> None:
    source = source.replace("at_s < self._end_s()),)", "at_s < self._end_s()),))") if "list((" in source else source
    (tmp_path / "bad_stage.py").write_text(source, encoding="utf-8")
    with pytest.raises(FingervisionError) as caught:
        open_bed(str(bed_at(tmp_path, "./bad_stage.py")))
    assert fact in str(caught.value)
    if fact != "upper_mm":
        assert "bad_stage.py" in str(caught.value)


def test_what_a_stage_raises_later_is_a_sentence_too(tmp_path: Path) -> None:
    source = STAGE.replace(
        "    def home(self) -> None:\n", "    def home(self) -> None:\n        raise ValueError(7)\n"
    )
    (tmp_path / "s.py").write_text(source, encoding="utf-8")
    bed = open_bed(str(bed_at(tmp_path, "s.py")))
    with pytest.raises(PluginShapeError, match=r"s\.py .*home.*ValueError: 7"):
        bed.actuator.home()
    bed.close()


def test_a_kind_that_is_neither_installed_nor_a_file_is_refused(tmp_path: Path) -> None:
    for kind in ("their_stage", "./nowhere.py"):
        with pytest.raises(FingervisionError, match=kind.strip("./")):
            open_bed(str(bed_at(tmp_path, kind)))


@pytest.mark.slow
def test_an_installed_model_answers_for_a_drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fingervision.models.answer_figures import LINEAR, Physics
    from fingervision.models.hinge_correction import HingeTheory
    from fingervision.testbed.simulation.gripper import sample_gripper

    points = {"one_spring": "fvdemo_spring", "bent": "fvdemo_bent", "fails": "fvdemo_fails"}
    modules = {
        "fvdemo_spring": SPRING,
        "fvdemo_bent": SPRING.replace("one_spring", "bent").replace("7.7 * np.asarray", "1.0 + 7.7 * np.asarray"),
        "fvdemo_fails": SPRING.replace("one_spring", "fails").replace("return OneSpring", "return 1 / 0 or OneSpring"),
    }
    install(tmp_path, monkeypatch, {"fingervision.models": points}, modules)
    assert set(points) < set(kinds())
    model = build_model("one_spring", sample_gripper(), LINEAR, HingeTheory.CORRECTED)
    assert model.name == "one_spring"
    for kind, fact in (("bent", "rest gap"), ("fails", "ZeroDivisionError")):
        with pytest.raises(FingervisionError, match=fact):
            build_model(kind, sample_gripper(), Physics(), HingeTheory.CORRECTED)
    assert "one_spring" in run("diagnose", "--help").output
    drawing = Path(__file__).parents[2] / "fingervision" / "models" / "micro_gripper.toml"
    done = run("model", str(drawing), "--kind", "one_spring", "--out", str(tmp_path / "out"))
    assert done.exit_code == 0, (done.output, done.exception)
    assert (tmp_path / "out" / "simulation.csv").exists()


def test_an_installed_source_opens_what_it_accepts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    modules = {
        "fvdemo_ramps": SOURCE,
        "fvdemo_raises": SOURCE.replace("    return name.st", "    raise OSError\n    return name.st"),
        "fvdemo_greedy": SOURCE.replace('return name.startswith("ramps:")', 'return name == "simulated"').replace(
            'or name.endswith(".ramp")', ""
        ),
    }
    points = {"ramps": "fvdemo_ramps", "raises": "fvdemo_raises", "greedy": "fvdemo_greedy", "none": "json"}
    install(tmp_path, monkeypatch, {"fingervision.frame_sources": points}, modules)
    assert open_source("ramps:3").description.kind == "made up"
    file = tmp_path / "a.ramp"
    file.write_text("a file that a video reader would try")
    assert open_source(str(file)).description.kind == "made up"
    with pytest.raises(PluginShapeError, match=r"ramps of .* none"):
        list(open_source("ramps:3", Wish(rate_hz=25.0)))
    with pytest.raises(UsageError, match="greedy"):
        open_source("simulated")


@pytest.mark.slow
def test_a_part_of_the_report_is_added_and_a_bad_one_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    modules = {
        "fvdemo_part": "TITLE = 'Weather'\ndef html(diagnosis): return f'<p>{diagnosis.report.verdict} and mild</p>'",
        "fvdemo_storm": "TITLE = 'Storm'\ndef html(diagnosis): raise OSError('wet')",
    }
    points = {"weather": "fvdemo_part", "storm": "fvdemo_storm"}
    install(tmp_path, monkeypatch, {"fingervision.report_parts": points}, modules)
    u = np.linspace(-0.4, 1.4, 40)
    rows = "".join(f"{x},{4.0 + 7.7 * x + 0.001 * (-1) ** k}\n" for k, x in enumerate(u))
    (tmp_path / "m.csv").write_text("input_mm,gap_mm\n" + rows)
    (tmp_path / "s.csv").write_text("input_mm,gap_mm\n-0.6,-0.62\n1.8,17.86\n")
    out = tmp_path / "out"
    done = run("diagnose", str(tmp_path / "m.csv"), "--model", str(tmp_path / "s.csv"), "--out", str(out))
    assert done.exit_code == 0, (done.output, done.exception)
    page = (out / "report.html").read_text()
    assert "Weather" in page
    assert "and mild</p>" in page
    assert "Storm" not in page
