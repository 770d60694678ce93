"""Models that are functions of time: FMUs and Python files, each in a separate process."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.errors import FingervisionError, ModelError
from fingervision.models import function_model
from fingervision.models.function_model import FunctionModel
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.models.fmu_build import build_fmu, can_build

needs_gcc = pytest.mark.skipif(not can_build(), reason="gcc or FMPy is not there")
OMEGA, DAMPING = 251.3274, 0.3
TIME_S = np.arange(0.0, 2.0, 0.005)
INPUT_MM = np.interp(TIME_S, [0.0, 0.5, 0.6, 1.2, 1.3, 2.0], [0.1, 0.1, 0.6, 0.6, 0.2, 0.2])


def truth_mm():
    """Response of the gripper of fmu_gripper.c, computed by scipy."""
    system = ([7.7 * OMEGA**2], [1.0, 2.0 * DAMPING * OMEGA, OMEGA**2])
    _, moved, _ = lsim(system, INPUT_MM - INPUT_MM[0], TIME_S)
    return 1.2 + 7.7 * INPUT_MM[0] + moved


def python_model(folder, text):
    """Write a model file."""
    path = folder / "model.py"
    path.write_text(text)
    return FunctionModel(path)


@needs_gcc
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", ["cs", "me"])
def test_an_fmu_answers_as_its_equations_do(tmp_path, version, kind):
    model = read_model(build_fmu(tmp_path, version, kind)).base
    (answer,) = model.simulate([(TIME_S, INPUT_MM)])
    # A co-simulation keeps its input constant for a quarter of a sample, 1.25 ms of a motion at 38 mm/s.
    assert np.max(np.abs(answer.gap_mm - truth_mm())) < (0.002 if kind == "me" else 0.02)


@pytest.mark.slow
@needs_gcc
def test_the_answer_at_rest_is_the_static_curve(tmp_path):
    table = FunctionModel(build_fmu(tmp_path)).at_rest(-0.1, 0.9)
    inputs = np.linspace(-0.1, 0.9, 7)
    assert np.allclose(table.respond(inputs).gap_mm, 1.2 + 7.7 * inputs, atol=1e-4)


@needs_gcc
def test_an_fmu_for_another_system_is_refused(tmp_path):
    model = FunctionModel(build_fmu(tmp_path, platform="win64"))
    with pytest.raises(ModelError, match=r"binary for this system .* has one for win64"):
        model.simulate([(TIME_S, INPUT_MM)])


@needs_gcc
def test_an_fmu_that_nothing_drives_is_refused(tmp_path):
    # Like BouncingBall, VanDerPol and Stair of the Reference FMUs, these models have no input.
    packed, changed = build_fmu(tmp_path), tmp_path / "changed.fmu"
    with zipfile.ZipFile(packed) as old, zipfile.ZipFile(changed, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                content = content.replace(b'causality="input"', b'causality="local"')
                content = content.replace(b'<Real unit="m" start="0"/>', b'<Real unit="m"/>')
            new.writestr(name, content)
    with pytest.raises(ModelError, match="must have an input variable of type Real"):
        FunctionModel(changed).simulate([(TIME_S, INPUT_MM)])


@pytest.mark.slow
@needs_gcc
def test_a_crash_and_an_endless_loop_become_sentences(tmp_path, monkeypatch):
    with pytest.raises(FingervisionError, match=r"crashed \(SIGSEGV\)"):
        FunctionModel(build_fmu(tmp_path, more=("-DCRASH",))).simulate([(TIME_S, INPUT_MM)])
    monkeypatch.setattr(function_model, "LONGEST_S", 4.0)
    with pytest.raises(FingervisionError, match="within 4 s"):
        FunctionModel(build_fmu(tmp_path, more=("-DHANG",))).simulate([(TIME_S, INPUT_MM)])


@pytest.mark.slow
@needs_gcc
def test_two_inputs_ask_which_one_and_a_model_toml_says_it(tmp_path):
    second = (
        '<ScalarVariable name="load" valueReference="9" causality="input" variability="continuous">'
        '<Real start="0"/></ScalarVariable>'
    )
    path = build_fmu(tmp_path, extra=second)
    assert FunctionModel(path).simulate([(TIME_S, INPUT_MM)])  # u is a usual name of an input
    document = tmp_path / "model.toml"
    document.write_text('schema = 1\nbase = "gripper.fmu"\ninput = "nothing"\n')
    with pytest.raises(FingervisionError, match="must have the variable nothing"):
        read_model(document).base.simulate([(TIME_S, INPUT_MM)])


@needs_gcc
def test_a_length_in_another_unit_is_refused(tmp_path):
    with pytest.raises(ModelError, match="is in rad"):
        FunctionModel(build_fmu(tmp_path, unit="rad")).simulate([(TIME_S, INPUT_MM)])


def test_a_python_function_is_driven_in_time(tmp_path):
    model = python_model(tmp_path, "def simulate(time_s, input_mm):\n    return 1.2 + 7.7 * input_mm\n")
    (answer,) = model.simulate([(TIME_S, INPUT_MM)])
    assert np.allclose(answer.gap_mm, 1.2 + 7.7 * INPUT_MM)
    both = "def simulate(t, u):\n    return {'left_mm': -u, 'right_mm': 2 * u, 'force_n': 3 * u}\n"
    (answer,) = python_model(tmp_path, both).simulate([(TIME_S, INPUT_MM)])
    assert np.allclose(answer.gap_mm, 3.0 * INPUT_MM)
    assert np.allclose(answer.force_n, 3.0 * INPUT_MM)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("x = (", "could not be loaded: SyntaxError"),
        ("import nothing_of_that_name", "could not be loaded: ModuleNotFoundError"),
        ("raise SystemExit(3)", "could not be loaded: SystemExit"),
        ("simulate = 3", r"must have a function simulate\(time_s, input_mm\)"),
        ("def simulate(t, u):\n    return 1 / 0", "failed in simulate: ZeroDivisionError"),
        ("def simulate(t, u):\n    return u[:3]", r"one value of gap_mm for each of the \d+ times .* but gives shape"),
        ("def simulate(t, u):\n    return u * float('nan')", "gives a NaN or infinity at 0 s"),
        (
            "def simulate(t, u):\n    return {'opening': u}",
            "must give gap_mm, or left_mm and right_mm, but gives opening",
        ),
        ("def simulate(t, u):\n    return 'wide'", "must give real numbers for gap_mm"),
        ("def simulate(t, u):\n    return u + 1j", "must give real numbers for gap_mm, but gives complex128"),
        ("def simulate(t, u):\n    return u > 0", "must give real numbers for gap_mm, but gives bool"),
        ("def simulate(t, u):\n    pass", "must give real numbers for gap_mm, but gives NoneType"),
        ("import os\ndef simulate(t, u):\n    os._exit(7)", "ended with code 7"),
        ("import os, signal\ndef simulate(t, u):\n    os.kill(os.getpid(), signal.SIGKILL)", r"crashed \(SIGKILL\)"),
    ],
)
def test_a_python_model_that_fails_is_a_sentence(tmp_path, text, sentence):
    with pytest.raises(ModelError, match=sentence):
        python_model(tmp_path, text).simulate([(TIME_S, INPUT_MM)])


@pytest.mark.slow
def test_what_is_no_fmu_is_a_sentence(tmp_path):
    path = tmp_path / "a.fmu"
    path.write_text("nothing of the kind")
    with pytest.raises(FingervisionError, match="must be an FMU"):
        FunctionModel(path).simulate([(TIME_S, INPUT_MM)])
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("modelDescription.xml", "<fmiModelDescription/>")
    with pytest.raises(FingervisionError, match="must be an FMU"):
        FunctionModel(path).simulate([(TIME_S, INPUT_MM)])
    with pytest.raises(FingervisionError, match="There is no model"):
        read_model(Path("none.fmu"))


@pytest.mark.slow
def test_a_gap_that_stands_or_never_settles_is_refused(tmp_path):
    with pytest.raises(FingervisionError, match="must depend on its input"):
        python_model(tmp_path, "def simulate(t, u):\n    return 0 * u\n").at_rest(0.0, 1.0)
    with pytest.raises(FingervisionError, match="come to rest"):
        python_model(tmp_path, "def simulate(t, u):\n    return u + t\n").at_rest(0.0, 1.0)


@pytest.mark.slow
@needs_gcc
def test_hidden_backlash_and_resonance_beside_an_fmu_are_named(tmp_path):
    """The simulated plant has the FMU's physics, a play of 40 um at its input, and a resonance at 6 Hz."""
    rng = np.random.default_rng(3)
    time_s = np.arange(0.0, 13.5, 1e-3)
    corners_s = [0, 1, 2.5, 3.5, 4.2, 5.2, 6.0, 7.5, 8.0, 9.2, 10, 11.5, 13]
    input_mm = np.interp(time_s, corners_s, [0, 0, 0.8, 0.8, 0.3, 0.3, 1.0, 1.0, 0.5, 0.5, 0.2, 0.2, 0])
    played, state = np.empty_like(input_mm), 0.0
    for i, place in enumerate(input_mm):
        state = min(max(state, place - 0.02), place + 0.02)
        played[i] = state
    _, inner, _ = lsim(([7.7 * OMEGA**2], [1.0, 2.0 * DAMPING * OMEGA, OMEGA**2]), played, time_s)
    slow = 2.0 * np.pi * 6.0
    _, moved, _ = lsim(([slow**2], [1.0, 0.2 * slow, slow**2]), inner, time_s)
    rows = slice(None, None, 25)
    noisy = 1.2 + moved[rows] + rng.normal(0.0, 1e-3, moved[rows].size)
    logged = input_mm[rows] + rng.normal(0.0, 5e-5, noisy.size)
    lines = [f"{t:.4f},{u:.6f},{g:.6f}" for t, u, g in zip(time_s[rows], logged, noisy, strict=True)]
    (tmp_path / "measured.csv").write_text("\n".join(["time_s,input_mm,gap_mm", *lines]))
    table, model = read_measured_table(tmp_path / "measured.csv"), read_model(build_fmu(tmp_path))
    report = diagnose(table, model).report
    assert report.verdict == "named"
    assert [effect.name for effect in report.effects] == ["backlash", "structural_resonance"]
    play = report.effects[0].parameters["play_mm"]
    assert abs(play.value - 0.04) < 5.0 * play.u
    assert report.effects[1].parameters["frequency_hz"].value == pytest.approx(6.0, rel=0.02)
