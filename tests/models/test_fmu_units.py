"""Units and names of an FMU's variables: asked for where they are not stated, and kept in a corrected model."""

import zipfile

import numpy as np
import pytest

from fingervision.domain.errors import ModelError
from fingervision.domain.parameter import Estimate
from fingervision.storage.model_toml import read_model, write_model
from tests.models.fmu_build import build_fmu, can_build

TIME_S = np.arange(0.0, 1.0, 0.01)
INPUT_MM = 0.1 + 0.2 * TIME_S


def without_units(path):
    """Remove the declared units of an FMU."""
    with zipfile.ZipFile(path) as packed:
        content = {name: packed.read(name) for name in packed.namelist()}
    with zipfile.ZipFile(path, "w") as packed:
        for name, data in content.items():
            packed.writestr(name, data.replace(b' unit="m"', b"") if name.endswith(".xml") else data)
    return path


@pytest.mark.skipif(not can_build(), reason="gcc or FMPy is not there")
def test_an_fmu_without_units_asks_for_them_and_the_corrected_model_keeps_them(tmp_path):
    stated = build_fmu(tmp_path)
    (truth,) = read_model(stated).base.simulate([(TIME_S, INPUT_MM)])
    (tmp_path / "other").mkdir()
    silent = without_units(build_fmu(tmp_path / "other"))
    with pytest.raises(ModelError, match="input_unit"):
        read_model(silent).base.simulate([(TIME_S, INPUT_MM)])
    document = tmp_path / "model.toml"
    document.write_text('schema = 1\nbase = "other/gripper.fmu"\ninput_unit = "m"\ngap_unit = "m"\ngap = "gap"\n')
    model = read_model(document)
    write_model(
        tmp_path / "again.toml", silent, {"backlash": {"play_mm": Estimate(0.01, None)}}, names=model.base.names
    )
    (found,) = read_model(tmp_path / "again.toml").base.simulate([(TIME_S, INPUT_MM)])
    np.testing.assert_allclose(found.gap_mm, truth.gap_mm)
