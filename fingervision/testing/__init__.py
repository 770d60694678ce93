"""The contract tests that every part passes, for authors of plug-ins: the package's own parts pass the same tests.

Derive a class whose name begins with `Test`, say what is to be tested, and run pytest; each method is one test, and a
failure is a sentence that says what the part must do and what it does::

    # tests/test_creeping_foot.py
    from fingervision.testing import EffectContract
    from fv_creeping_foot import EFFECT

    class TestCreepingFoot(EffectContract):
        effect = EFFECT

| part | class | what it is given |
|---|---|---|
| effect | `EffectContract` | `effect`: a `DriveEffect` or `PointEffect` |
| effect, by a whole diagnosis | `HiddenEffectContract` | `effect`, and `values` where you know better |
| model | `ModelContract` | `kind`: a module or object with `KIND` and `build(gripper, physics, theory)` |
| frame source | `FrameSourceContract` | `kind`: with `accepts` and `open_frames`; `name`: what it opens |
| actuator | `ActuatorContract` | `open_bed()`: a bed that has it |
| force sensor | `ForceSensorContract` | `open_bed()`: a bed that has it |
| camera | `CameraContract` | `open_bed()`: a bed that has it |

A bed is most easily opened from its file: `open_bed = lambda self: fingervision.testing.bed_at("bed.toml")`. Nothing
here imports pytest. Without it, `run(EffectContract, effect=EFFECT)` runs all tests and returns a sentence for each one
that fails. `diagnosed(effect, values)` simulates data with an effect, diagnoses them, and returns the report.
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
