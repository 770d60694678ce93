"""Worker process of a user's model, a Python file or an FMU: reads times and inputs, writes positions of the fingers.

An FMU (FMI 2 or 3, model exchange or co-simulation) is run as a function of time, by FMPy.
"""

import json
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.effect import Array
from fingervision.models.function_model import FUNCTION, SAYS, Answer, Function, answer_of, points_of

UNITS_MM: Mapping[str, float] = {"m": 1e3, "cm": 10.0, "mm": 1.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "nm": 1e-6}
"""Millimetres per unit of length, by the unit's name."""
INPUTS = ("input_mm", "input", "u_in", "u", "position", "displacement", "stroke", "x", "in")
GAPS = ("gap_mm", "gap", "opening", "y", "out", "output")
OTHERS = ("left_mm", "right_mm", "force_n")
FINER = 4
"""Number of co-simulation steps between two given times. The FMU keeps its input constant during a step: at the value
in the middle of the step, by which a state comes out right, or later, if its output follows the input at once."""
FOLLOWS_AT_ONCE = 0.5
"""Lag of the output of an FMU without states, in steps: it shows the input of the middle of the step at its end."""
MOST_STEPS = 200_000
LONGEST_STEP_S = 0.01
"""Longest co-simulation step, however far apart the given times are: a vibration at 10 Hz is then still sampled ten
times per period."""


def fmu_function(path: Path, names: Mapping[str, str], folder: Path) -> "Fmu":
    """Return an FMU as a function of time.

    Parameters
    ----------
    path : Path
        Path of the `.fmu` file.
    names : mapping of str to str
        Names of the FMU's variables for `input` and `gap`, and their units `input_unit` and `gap_unit`, where stated.
    folder : Path
        Folder of the caller's, into which the FMU is unpacked.

    Raises
    ------
    ValueError
        If FMPy is missing, the file is no FMU for this system, or it cannot be decided which variables are input and
        gap, or which units they have.
    """
    try:
        from fmpy import extract, platform, read_model_description, supported_platforms
    except ImportError:
        raise ValueError(
            "is an FMU, which is read by the library FMPy: install that with `pip install fingervision[fmu]`."
        ) from None
    if not path.is_file():
        raise ValueError("must be a file, but does not exist.")
    try:
        description = read_model_description(str(path))
        platforms = supported_platforms(str(path))
    except Exception as error:
        raise ValueError(f"must be an FMU, but cannot be read as one ({_first_line(error)}).") from error
    if description.fmiVersion[:1] not in "23":
        raise ValueError(f"must be an FMU of FMI 2 or 3, but is of FMI {description.fmiVersion}: export it again.")
    if platform not in platforms:
        there = ", ".join(platforms) or "no system at all"
        raise ValueError(
            f"must hold a binary for this system ({platform}), but has one for {there}: export it for {platform}."
        )
    chosen = _choose(description.modelVariables, "input", names.get("input"), INPUTS)
    outputs = _outputs(description.modelVariables, names)
    input_mm = _mm("input", chosen, names.get("input_unit"))
    scales = {
        name: 1.0 if name == "force_n" else _mm("gap", variable, names.get("gap_unit"))
        for name, variable in outputs.items()
    }
    return Fmu(extract(str(path), str(folder)), description, chosen, input_mm, outputs, scales)


@dataclass(frozen=True, slots=True)
class Fmu:
    """An FMU as a function of time.

    Parameters
    ----------
    unpacked : str
        Folder with its files.
    description : ModelDescription
        Its description, as FMPy reads it.
    input : ScalarVariable
        The input.
    input_mm : float
        Millimetres per unit of the input.
    outputs : mapping of str to ScalarVariable
        The outputs by the names of columns.
    scales : mapping of str to float
        Millimetres, or newtons, per unit of each output.
    """

    unpacked: str
    description: Any
    input: Any
    input_mm: float
    outputs: Mapping[str, Any]
    scales: Mapping[str, float]

    def __call__(self, time_s: Array, input_mm: Array) -> dict[str, Array]:
        """Simulate one run and return its outputs at the run's times."""
        _drive_between_steps()
        span_s = float(time_s[-1] - time_s[0])
        step_s = min(float(np.median(np.diff(time_s))) / FINER, LONGEST_STEP_S)
        steps = int(np.ceil(min(span_s / step_s, MOST_STEPS)))
        if self.description.coSimulation is None:
            return self._stepped(time_s, input_mm, steps, 0.0)
        coarse, fine = (self._stepped(time_s, input_mm, count * steps, 0.5) for count in (1, 2))
        lengths = [name for name in self.outputs if name != "force_n"]
        lag = max(_lag_in_steps(coarse[name], fine[name], time_s, span_s / steps) for name in lengths)
        return fine if lag == 0.0 else self._stepped(time_s, input_mm, 2 * steps, 0.5 + lag)

    def _stepped(self, time_s: Array, input_mm: Array, steps: int, ahead: float) -> dict[str, Array]:
        """Simulate with a number of steps; `ahead` is the part of a step at whose end the input is read."""
        from fmpy import simulate_fmu

        span_s = float(time_s[-1] - time_s[0])
        step_s, name = span_s / steps, self.input.name
        signal = np.empty(time_s.size + 1, dtype=[("time", "f8"), (name, "f8")])
        signal["time"] = np.concatenate([[-step_s], time_s - time_s[0] - ahead * step_s])
        signal[name] = np.concatenate([input_mm[:1], input_mm]) / self.input_mm
        is_stepped = self.description.coSimulation is not None
        try:
            found = simulate_fmu(
                self.unpacked,
                validate=False,
                start_time=0.0,
                stop_time=span_s,
                output_interval=step_s,
                step_size=step_s if is_stepped else None,
                fmi_type="CoSimulation" if is_stepped else "ModelExchange",
                start_values={name: float(signal[name][0])},
                input=signal,
                output=[variable.name for variable in self.outputs.values()],
                model_description=self.description,
                remote_platform=None,
            )
        except Exception as error:
            raise ValueError(f"could not be simulated: {_first_line(error)}") from error
        # At a jump, FMPy states two values for one time; the later one is kept.
        at_s, kept = np.unique(found["time"][::-1], return_index=True)
        return {
            column: np.interp(time_s - time_s[0], at_s, np.asarray(found[variable.name], dtype=np.float64)[::-1][kept])
            * self.scales[column]
            for column, variable in self.outputs.items()
        }


def _lag_in_steps(coarse: Array, fine: Array, time_s: Array, step_s: float) -> float:
    """Lag of the output of a co-simulation, in steps, from two simulations with steps of `step_s` and half of it.

    To first order, an output that lags by a part of a step differs between the two by half of that part, times the step
    and the output's speed (Richardson). The result is 0 for an FMU whose output is a state.
    """
    if time_s.size < 3:
        return 0.0
    speed = np.gradient(fine, time_s)
    squares = float(speed @ speed)
    if squares == 0.0:
        return 0.0
    lag = -2.0 * float((coarse - fine) @ speed) / (step_s * squares)
    return float(np.clip(lag, 0.0, FOLLOWS_AT_ONCE))


def _drive_between_steps() -> None:
    """Let FMPy's integrator read the input at each time that it evaluates, instead of the input at the last step.

    FMPy 0.3 sets inputs only before a step of the integrator and in the root function. During a step of the integrator
    CVode a moving input then lags, and the integrator's error test fails where the input jumps. FMPy's class is
    replaced in the whole worker process, which runs only the model.
    """
    from fmpy import sundials

    if getattr(sundials.CVodeSolver, "sees_input", False):
        return

    class Driven(sundials.CVodeSolver):  # type: ignore[misc]
        sees_input = True

        def f(self, t: float, y: Any, ydot: Any, user_data: Any) -> int:
            self.input.apply(t, discrete=False)
            return int(super().f(t, y, ydot, user_data))

    sundials.CVodeSolver = Driven


def _outputs(variables: list[Any], names: Mapping[str, str]) -> dict[str, Any]:
    """Choose the output variables: the gap, or the positions of both fingers, and the force if there is one."""
    listed = {variable.name.lower(): variable for variable in variables if variable.causality == "output"}
    out = {name: listed[name] for name in OTHERS if name in listed}
    if not ({"left_mm", "right_mm"} <= set(out)) or "gap" in names:
        out = {name: out[name] for name in ("force_n",) if name in out}
        out["gap_mm"] = _choose(variables, "output", names.get("gap"), GAPS)
    return out


def _choose(variables: list[Any], causality: str, stated: str | None, usual: tuple[str, ...]) -> Any:
    """Choose the variable with the stated name, else a variable with a usual name, else the only variable."""
    word = "input" if causality == "input" else "gap"
    real = [one for one in variables if one.causality == causality and one.type in ("Real", "Float64", "Float32")]
    if stated is not None:
        for one in variables:
            if one.name == stated:
                return one
        raise ValueError(f"must have the variable {stated} (as `{word}` states), but has {_listed(real)}.")
    by_name = {one.name.lower(): one for one in real}
    if (known := next((name for name in usual if name in by_name), None)) is not None:
        return by_name[known]
    continuous = [one for one in real if one.variability in (None, "continuous")]
    for found in (real, continuous):
        if len(found) == 1:
            return found[0]
    if not real:
        raise ValueError(f"must have an {causality} variable of type Real or Float, but has none.")
    raise ValueError(
        f"has {len(real)} {causality}s ({_listed(real)}), and it is not stated which of them is the {word}: "
        "name it in a "
        f'model.toml with base = "the.fmu" and {word} = "its name".'
    )


def _listed(variables: list[Any]) -> str:
    return ", ".join(one.name for one in variables[:8]) or "none"


def _mm(role: str, variable: Any, stated: str | None) -> float:
    """Millimetres per unit of a variable: from the stated unit, its declared unit, or the suffix of its name."""
    unit = stated or variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)
    if unit is None and (ending := re.search(r"_(m|cm|mm|um|nm)$", variable.name)) is not None:
        unit = ending.group(1)
    if unit is None:
        raise ValueError(
            f"does not state the unit of {variable.name} ({role}), and simulation programs use metres as well as "
            f'millimetres: state it in a model.toml with base = "the.fmu" and {role}_unit = "m".'
        )
    if unit not in UNITS_MM:
        raise ValueError(
            f"must have lengths as input and gap, but {variable.name} is in {unit}: choose another variable."
        )
    return UNITS_MM[unit]


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:300]


def main(arguments: list[str]) -> int:
    """Run the model `arguments[0]` over the runs of a file, and write its responses to another."""
    path, asked, answered, names = Path(arguments[0]), arguments[1], arguments[2], json.loads(arguments[3])
    try:
        is_fmu = path.suffix.lower() == ".fmu"
        function = fmu_function(path, names, Path(asked).parent / "fmu") if is_fmu else _python_function(path)
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
