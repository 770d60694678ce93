"""Worker process of a user's model: reads times and inputs, and writes positions of the fingers' measuring points."""

import json
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.effect import Array
from fingervision.models.fmu import fmu_function
from fingervision.models.function_model import FUNCTION, SAYS, Answer, Function, answer_of, points_of


def main(arguments: list[str]) -> int:
    """Run the model `arguments[0]` over the runs of a file, and write its responses to another."""
    path, asked, answered, names = Path(arguments[0]), arguments[1], arguments[2], json.loads(arguments[3])
    try:
        function = fmu_function(path, names) if path.suffix.lower() == ".fmu" else _python_function(path)
        out: dict[str, Any] = {}
        with np.load(asked) as runs:
            for k in range(len(runs.files) // 2):
                for name, values in points_of(function(runs[f"time{k}"], runs[f"input{k}"]), runs[f"time{k}"]).items():
                    out[f"{name}{k}"] = values
        np.savez(answered, **out)
    except ValueError as error:
        sys.stderr.write(f"\n{SAYS}{' '.join(str(error).split())}\n")
        return 1
    return 0


def _python_function(path: Path) -> Function:
    """Load `simulate` from a Python file; modules that the file imports are searched in the file's folder."""
    sys.path.insert(0, str(path.parent))
    spec = spec_from_file_location("model_of_ones_own", path)
    if spec is None or spec.loader is None:
        raise ValueError("must be a Python file, but cannot be loaded as one.")
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except FileNotFoundError:
        raise ValueError("must be a file, but does not exist.") from None
    except (Exception, SystemExit) as error:
        raise ValueError(f"could not be loaded: {type(error).__name__}: {error}") from error
    simulate = getattr(module, FUNCTION, None)
    if not callable(simulate):
        raise ValueError("must have a function simulate(time_s, input_mm), but has none.")  # noqa: TRY004 - a sentence

    def function(time_s: Array, input_mm: Array) -> Answer:
        try:
            return answer_of(simulate, time_s, input_mm)
        except (Exception, SystemExit) as error:
            raise ValueError(f"failed in simulate: {type(error).__name__}: {error}") from error

    return function


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
