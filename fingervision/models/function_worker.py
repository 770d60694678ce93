"""Worker process of a user's model: reads times and inputs, and writes positions of the fingers' measuring points."""

import json
import sys
from collections.abc import Callable, Mapping
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.effect import Array
from fingervision.models.fmu import fmu_function
from fingervision.models.function_model import FUNCTION, SAYS

Answer = Mapping[str, Array]
Function = Callable[[Array, Array], Answer]


def main(arguments: list[str]) -> int:
    """Run the model `arguments[0]` over the runs of a file, and write its responses to another."""
    path, asked, answered, names = Path(arguments[0]), arguments[1], arguments[2], json.loads(arguments[3])
    try:
        function = fmu_function(path, names) if path.suffix.lower() == ".fmu" else _python_function(path)
        out: dict[str, Any] = {}
        with np.load(asked) as runs:
            for k in range(len(runs.files) // 2):
                for name, values in _points(function(runs[f"time{k}"], runs[f"input{k}"]), runs[f"time{k}"]).items():
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
            found = simulate(time_s.copy(), input_mm.copy())
        except (Exception, SystemExit) as error:
            raise ValueError(f"failed in simulate: {type(error).__name__}: {error}") from error
        return found if isinstance(found, Mapping) else {"gap_mm": found}

    return function


def _points(answer: Answer, time_s: Array) -> dict[str, Array]:
    """Convert a model's return value to left, right and force; refuse a value without one finite number per time."""
    out: dict[str, Array] = {}
    for name in ("gap_mm", "left_mm", "right_mm", "force_n"):
        if name not in answer:
            continue
        try:
            values = np.asarray(answer[name], dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueError(f"must give numbers for {name}, but gives {type(answer[name]).__name__}.") from None
        if values.shape != time_s.shape:
            raise ValueError(
                f"must give {time_s.size} values of {name}, one for each time, but gives shape {values.shape}."
            )
        if not np.all(np.isfinite(values)):
            at_s = float(time_s[np.flatnonzero(~np.isfinite(values))[0]])
            raise ValueError(f"must give finite values of {name}, but gives a NaN or infinity at {at_s:g} s.")
        out[name] = values
    if "left_mm" in out and "right_mm" in out:
        out.pop("gap_mm", None)
        return out
    if "gap_mm" not in out:
        said = ", ".join(str(name) for name in answer) or "nothing"
        raise ValueError(f"must give gap_mm, or left_mm and right_mm, but gives {said}.")
    gap_mm = out.pop("gap_mm")
    return {"left_mm": -0.5 * gap_mm, "right_mm": 0.5 * gap_mm} | {
        name: out[name] for name in ("force_n",) if name in out
    }


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
