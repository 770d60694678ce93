"""FMUs with the variables and equations of the Reference FMUs (Modelica Association), written independently and built
by gcc.

The published archives are in no package index; the variables are those of their modelDescription.xml.
"""

import tempfile

import numpy as np
import pytest

from fingervision.domain.errors import ModelError
from fingervision.models.function_model import FunctionModel
from fingervision.storage.model_toml import read_model
from tests.models.fmu_build import can_build, pack_fmu2

needs_gcc = pytest.mark.skipif(not can_build(), reason="gcc or FMPy is not there")
TIME_S = np.arange(0.0, 2.0, 0.01)
INPUT_MM = np.interp(TIME_S, [0.0, 0.5, 1.0, 2.0], [0.0, 0.0, 1.0, 0.3])
REAL = '<ScalarVariable name="{}" valueReference="{}" causality="{}" variability="{}"{}><Real{}/></ScalarVariable>'
FEEDTHROUGH = "\n".join(
    [
        REAL.format("Float64_fixed_parameter", 0, "parameter", "fixed", "", ' start="0"'),
        REAL.format("Float64_tunable_parameter", 1, "parameter", "tunable", "", ' start="0"'),
        REAL.format("Float64_continuous_input", 2, "input", "continuous", "", ' start="0"'),
        REAL.format("Float64_continuous_output", 3, "output", "continuous", ' initial="calculated"', ""),
        REAL.format("Float64_discrete_input", 4, "input", "discrete", "", ' start="0"'),
        REAL.format("Float64_discrete_output", 5, "output", "discrete", ' initial="calculated"', ""),
        '<ScalarVariable name="Int32_input" valueReference="6" causality="input" variability="discrete">'
        '<Integer start="0"/></ScalarVariable>',
        '<ScalarVariable name="String_parameter" valueReference="10" causality="parameter" variability="fixed">'
        '<String start="Set me!"/></ScalarVariable>',
    ]
)
UNITS = 'input_unit = "mm"\ngap_unit = "mm"\n'
OUTPUT = REAL.format("{}", "{}", "output", "continuous", ' initial="exact"', ' start="1"')
NOTHING_DRIVES = {
    "BouncingBall": ("-DBALL", OUTPUT.format("h", 0) + OUTPUT.format("v", 1)),
    "VanDerPol": ("-DPOL", OUTPUT.format("x0", 0) + OUTPUT.format("x1", 1)),
    "Stair": (
        "-DSTAIR",
        '<ScalarVariable name="counter" valueReference="1" causality="output" variability="discrete" initial="exact">'
        '<Integer start="1"/></ScalarVariable>',
    ),
}


@needs_gcc
@pytest.mark.parametrize("kind", ["cs", "me"])
def test_feedthrough_gives_its_continuous_input_among_others_of_other_kinds(tmp_path, kind, monkeypatch):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", None)
    pack_fmu2(tmp_path, "Feedthrough", FEEDTHROUGH, kind)
    (tmp_path / "model.toml").write_text(f'schema = 1\nbase = "Feedthrough.fmu"\n{UNITS}')
    model = read_model(tmp_path / "model.toml").base
    (answer,) = model.simulate([(TIME_S, INPUT_MM)])
    # A co-simulation that shows its input at once must not lag by half a step (2.5 um here).
    assert np.max(np.abs(answer.gap_mm - INPUT_MM)) < 1e-6
    # Each run of a fit would leave the unpacked file there.
    assert not list(temporary.iterdir())


@pytest.mark.slow
@needs_gcc
def test_feedthrough_takes_the_discrete_pair_where_it_is_named(tmp_path):
    pack_fmu2(tmp_path, "Feedthrough", FEEDTHROUGH, "cs")
    document = tmp_path / "model.toml"
    document.write_text(
        'schema = 1\nbase = "Feedthrough.fmu"\ninput = "Float64_discrete_input"\ngap = "Float64_discrete_output"\n'
        + UNITS
    )
    (answer,) = read_model(document).base.simulate([(TIME_S, INPUT_MM)])
    assert np.max(np.abs(answer.gap_mm - INPUT_MM)) < 0.03


@needs_gcc
@pytest.mark.parametrize("name", list(NOTHING_DRIVES))
def test_a_reference_fmu_without_an_input_is_refused_with_the_reason(tmp_path, name):
    option, variables = NOTHING_DRIVES[name]
    path = pack_fmu2(tmp_path, name, variables, "cs", option)
    with pytest.raises(ModelError, match=r"must have an input variable of type Real or Float, but has none"):
        FunctionModel(path).simulate([(TIME_S, INPUT_MM)])
