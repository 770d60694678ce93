"""Contract tests for authors of plug-ins; the built-in parts of the package pass the same tests.

Derive a class whose name begins with `Test`, state the part to be tested as a class attribute, and run pytest. Each
method is one test; a failure is reported by a sentence that states what the part must do and what it does::

    # tests/test_creeping_foot.py
    from fingervision.testing import EffectContract
    from fv_creeping_foot import EFFECT

    class TestCreepingFoot(EffectContract):
        effect = EFFECT

| part | class | attributes to define |
|---|---|---|
| effect | `EffectContract` | `effect`: a `DriveEffect` or `PointEffect` |
| effect, by a whole diagnosis | `HiddenEffectContract` | `effect`; optionally `values` instead of the default ones |
| model | `ModelContract` | `kind`: a module or object with `KIND` and `build(gripper, physics, theory)` |
| frame source | `FrameSourceContract` | `kind`, with `accepts` and `open_frames`; `name` of a recording that it opens |
| actuator | `ActuatorContract` | `open_bed()`: a test bed with the actuator |
| force sensor | `ForceSensorContract` | `open_bed()`: a test bed with the sensor |
| camera | `CameraContract` | `open_bed()`: a test bed with the camera |

The simplest way to open a test bed is from its file: `open_bed = lambda self: fingervision.testing.bed_at("bed.toml")`.
`fingervision.testing` does not import pytest. Without pytest, `run(EffectContract, effect=EFFECT)` runs all tests and
returns a sentence for each failed test. `diagnosed(effect, values)` simulates data with an effect, diagnoses these
data, and returns the report.
"""

from fingervision.testing.bed_contract import ActuatorContract, CameraContract, ForceSensorContract, bed_at
from fingervision.testing.contract import ContractError, NotApplicable, checks_of, run
from fingervision.testing.effect_contract import EffectContract
from fingervision.testing.frame_source_contract import FrameSourceContract
from fingervision.testing.hidden_effect import HiddenEffectContract, diagnosed
from fingervision.testing.model_contract import ModelContract

__all__ = [
    "ActuatorContract",
    "CameraContract",
    "ContractError",
    "EffectContract",
    "ForceSensorContract",
    "FrameSourceContract",
    "HiddenEffectContract",
    "ModelContract",
    "NotApplicable",
    "bed_at",
    "checks_of",
    "diagnosed",
    "run",
]
