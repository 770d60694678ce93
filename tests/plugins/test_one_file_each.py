"""An effect, a model, a camera, an actuator and a frame source added in a copy of the package: one file each."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.plugins.installed import effect_source
from tests.plugins.test_devices_from_elsewhere import BED, SOURCE, SPRING, STAGE

ROOT = Path(__file__).parents[2]
CAMERA = (
    '"""A camera like the simulated one."""\n'
    "from fingervision.testbed.cameras.simulated import KEYS, SIMULATED, build\n"
)
FRAMES = "return (Frame(np.full((24, 32), 80 * k, np.uint8), k) for k in range(3))"
FILES = {
    "effects/screw_bend.py": effect_source(),
    "models/one_spring.py": SPRING,
    "frames/ramps.py": SOURCE.replace("return iter([])", FRAMES),
    "testbed/actuators/their_stage.py": STAGE,
    "testbed/cameras/their_camera.py": CAMERA,
}
PROGRAM = """
import json
from fingervision.effects import catalogue, origin_of
from fingervision.frames.source_kinds import REGISTRY as SOURCES
from fingervision.models.kinds import REGISTRY as MODELS
from fingervision.testing import (
    ActuatorContract, CameraContract, EffectContract, FrameSourceContract, ModelContract, bed_at, diagnosed, run
)

class Stage(ActuatorContract):
    open_bed = lambda self: bed_at("bed.toml")

class Camera(CameraContract):
    open_bed = lambda self: bed_at("bed.toml")

report = diagnosed("screw_bend", {"bend_per_mm2": 0.03})
print(json.dumps({
    "built_in": origin_of("screw_bend").built_in,
    "failed": [
        run(EffectContract, effect=catalogue()["screw_bend"]),
        run(ModelContract, kind=MODELS.get("one_spring").value),
        run(FrameSourceContract, kind=SOURCES.get("ramps").value, name="ramps:3"),
        run(Stage),
        run(Camera),
    ],
    "named": [effect.name for effect in report.effects],
}))
"""


@pytest.mark.slow
def test_what_is_added_as_one_file_is_found_by_contracts_and_diagnosis(tmp_path: Path) -> None:
    ignore = shutil.ignore_patterns("__pycache__")
    for package in ("fingervision", "calib"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignore)
    for name, source in FILES.items():
        (tmp_path / "fingervision" / name).write_text(source, encoding="utf-8")
    bed = BED.replace("KIND", "their_stage").replace('kind = "simulated"', 'kind = "their_camera"')
    (tmp_path / "bed.toml").write_text(bed, encoding="utf-8")
    clean = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path, env=clean, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {"built_in": True, "failed": [{}, {}, {}, {}, {}], "named": ["screw_bend"]}
