"""A model that is a function of time: an FMU, a Python file with `simulate(time_s, input_mm)`, or such a function."""

import json
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, cast

import numpy as np

from fingervision.domain.effect import Array
from fingervision.domain.errors import ModelError, UsageError
from fingervision.domain.response import Response
from fingervision.models.table import TableModel

SUFFIXES = (".fmu", ".py")
FUNCTION = "simulate"
"""Name of the function of a Python file that is a model."""
LONGEST_S = 120.0
"""Longest wall time of one call: the model of an ordinary gripper with some hundred states needs one or two seconds."""
STEPS = 21
"""Number of inputs, from lowest to highest, at which the model is run until the gap is at rest; between these inputs,
the static gap is interpolated linearly. The error of this interpolation is part of the difference that is simulated
over time."""
HOLDS_S = (2.0, 8.0, 32.0)
"""Hold times tried one after another until the gap has settled: grippers ring for less than a second and creep for
about a minute."""
SETTLED = 1e-4
"""Largest change of the gap in the second half of a hold that counts as settled, as a share of the gap's range."""


Answer = Mapping[str, Array]
Function = Callable[[Array, Array], Any]
"""Function of times and inputs, shape (n,) each, that returns the gap, or a mapping with `gap_mm` or `left_mm` and
`right_mm`, and where there is one `force_n`, shape (n,) each."""


def model_file(path: Path) -> Path:
    """Return the file of a model; a Python file may be followed by the name of its function, as `model.py:simulate`.

    Raises
    ------
    UsageError
        The function has another name.
    """
    file, separator, function = str(path).rpartition(".py:")
    if not separator or path.exists():
        return path
    if function != FUNCTION:
        raise UsageError(
            f"The function of a Python model must have the name {FUNCTION}, but {path} names {function!r}: rename it."
        )
    return Path(f"{file}.py")


@dataclass(frozen=True, slots=True)
class FunctionModel:
    """A file or a function that predicts the gap over time from the input over time.

    Parameters
    ----------
    path : Path
        `.fmu` (FMI 2 or 3, model exchange or co-simulation) or `.py`; for a function, its name.
    names : mapping of str to str
        Names of the FMU's variables for `input` and `gap`, if its variables are named otherwise.
    function : callable or None
        A function in memory; it is called in this process, because it may belong to a notebook.
    """

    path: Path
    names: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    function: Function | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how a pickle makes the model: a function that cannot be pickled stays in its process."""
        return _unpickled, (self.path, self.names, None if self.function is None else _pickled(self.function))

    def respond(self, input_mm: Array) -> Response:
        """Static response at each input, which is held until the gap has settled; `input_mm` of shape (n,)."""
        if np.ptp(input_mm) == 0.0:
            time_s = np.array([0.0, 0.5, 1.0]) * HOLDS_S[0]
            (held,) = self.simulate([(time_s, np.full(3, float(input_mm[0])))])
            last = np.full(input_mm.size, 2)
            return held.at(last)
        return self.at_rest(float(input_mm.min()), float(input_mm.max())).respond(input_mm)

    def at_rest(self, low_mm: float, high_mm: float) -> TableModel:
        """Tabulate the static gap, as the mean of runs with increasing and decreasing input.

        Raises
        ------
        ModelError
            If the model fails, or its gap does not depend on the input or never settles.
        """
        up = np.linspace(low_mm, high_mm, STEPS)
        places = np.concatenate([up, up[::-1]])
        for hold_s in HOLDS_S:
            begin = np.arange(places.size) * hold_s
            offsets = hold_s * np.array([0.1, 0.55, 1.0])
            time_s = (begin[:, None] + offsets).ravel()
            (answer,) = self.simulate([(np.insert(time_s, 0, 0.0), np.insert(np.repeat(places, 3), 0, places[0]))])
            gap = answer.gap_mm[1:].reshape(-1, 3)
            reach = float(np.ptp(gap[:, 2]))
            if reach == 0.0:
                raise ModelError(
                    f"The gap of {self.path} must depend on its input, but is {gap[0, 2]:g} mm at every input "
                    f"from {low_mm:g} to {high_mm:g} mm: check its units and which variables are input and gap."
                )
            if float(np.max(np.abs(gap[:, 2] - gap[:, 1]))) < SETTLED * reach:
                break
        else:
            raise ModelError(
                f"The gap of {self.path} must come to rest at a held input, but still moves after {HOLDS_S[-1]:g} s: "
                "give a model that is stable, or a table of its static response."
            )
        last = answer.at(np.arange(3, 3 * places.size + 1, 3))

        def mean(column: Array) -> Array:
            return np.asarray(0.5 * (column[:STEPS] + column[STEPS:][::-1]))

        force = None if last.force_n is None else mean(last.force_n)
        return TableModel(self.path.name, up, mean(last.left_mm), mean(last.right_mm), force)

    def simulate(self, runs: Sequence[tuple[Array, Array]]) -> list[Response]:
        """Simulate the runs, each from its own initial state; a file is run in a separate process.

        Parameters
        ----------
        runs : sequence of (ndarray of float, ndarray of float), each of shape (n,)
            Times, strictly increasing from 0, and inputs in mm; the input is linear between these points.

        Raises
        ------
        ModelError
            If the file cannot be run, crashes, does not end, or returns something that is not a number.
        """
        if self.function is not None:
            return [_response(self._called(self.function, *run), 0) for run in runs]
        with TemporaryDirectory(prefix="fingervision-") as folder:
            asked, answered = Path(folder) / "asked.npz", Path(folder) / "answered.npz"
            arrays: dict[str, Any] = {
                f"{name}{k}": run[i] for k, run in enumerate(runs) for i, name in enumerate(("time", "input"))
            }
            np.savez(asked, **arrays)
            command = [sys.executable, "-m", "fingervision.models.function_worker", str(self.path.resolve())]
            command += [str(asked), str(answered), json.dumps(dict(self.names))]
            try:
                ended = subprocess.run(
                    command, capture_output=True, timeout=LONGEST_S, check=False, stdin=subprocess.DEVNULL
                )
            except subprocess.TimeoutExpired:
                raise ModelError(
                    f"{self.path} must answer within {LONGEST_S:g} s, but was still running and was stopped: look for "
                    "an endless loop, or run the model beforehand and give its results as a table."
                ) from None
            if ended.returncode != 0 or not answered.is_file():
                raise ModelError(self._failure(ended.returncode, ended.stderr))
            with np.load(answered) as found:
                return [_response(found, k) for k in range(len(runs))]

    def _called(self, function: Function, time_s: Array, input_mm: Array) -> dict[str, Array]:
        """Call a function in memory for one run."""
        try:
            points = points_of(answer_of(function, time_s, input_mm), time_s)
        except ValueError as error:
            raise ModelError(f"The function {self.path} {error}") from error
        except Exception as error:
            raise ModelError(f"The function {self.path} failed: {type(error).__name__}: {error}") from error
        return {f"{name}0": values for name, values in points.items()}

    def _failure(self, code: int, stderr: bytes) -> str:
        """Explain in a message how the worker process failed."""
        said = stderr.decode(errors="replace").strip().splitlines()
        if said and said[-1].startswith(SAYS):
            return f"{self.path} {said[-1].removeprefix(SAYS)}"
        if code < 0:
            name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
            return f"{self.path} must answer, but crashed ({name}): correct the model; no data were lost."
        last = f" The last line of its error output: {said[-1][:300]}" if said else ""
        return f"{self.path} must answer, but its process ended with code {code}: correct the model.{last}"


PICKLED_BY = ["pickle", "cloudpickle"]
"""Modules that pickle a function; cloudpickle, which is there with Dask and joblib, pickles lambdas too."""


def _pickled(function: Function) -> bytes:
    """Pickle a function; b"" if it cannot be pickled."""
    for by in PICKLED_BY:
        try:
            return cast("bytes", import_module(by).dumps(function))
        except Exception:  # a function may hold anything, and pickling it raise anything
            continue
    return b""


def _unpickled(path: Path, names: Mapping[str, str], function: bytes | None) -> FunctionModel:
    def stayed(time_s: Array, input_mm: Array) -> Array:
        raise ValueError(
            "must be one that can be pickled, but stayed in the process that pickled this result: define it with `def` "
            "in a module, or install cloudpickle."
        )

    if function is None:
        return FunctionModel(path, names)
    return FunctionModel(path, names, pickle.loads(function) if function else stayed)


SAYS = "fingervision-model: "
"""Prefix of the line in which the worker process reports why it could not compute a response."""


def _response(found: Mapping[str, Array], k: int) -> Response:
    return Response(found[f"left_mm{k}"], found[f"right_mm{k}"], found.get(f"force_n{k}"))


def answer_of(function: Function, time_s: Array, input_mm: Array) -> Answer:
    """Call a user's function with copies of the times and inputs; an array as the answer is the gap."""
    found = function(time_s.copy(), input_mm.copy())
    return found if isinstance(found, Mapping) else {"gap_mm": found}


def points_of(answer: Answer, time_s: Array) -> dict[str, Array]:
    """Convert a model's return value to left, right and force; refuse a value without one finite number per time."""
    out: dict[str, Array] = {}
    for name in ("gap_mm", "left_mm", "right_mm", "force_n"):
        if name not in answer:
            continue
        try:
            stated = np.asarray(answer[name])
            # NumPy makes floats of truth values, and of complex numbers with a mere warning.
            is_real = answer[name] is not None and stated.dtype.kind not in "bc"
            values = stated.astype(np.float64) if is_real else None
        except (TypeError, ValueError):
            values = None
        if values is None:
            what = getattr(answer[name], "dtype", type(answer[name]).__name__)
            raise ValueError(f"must give real numbers for {name}, but gives {what}.")
        if values.shape != time_s.shape:
            gives = f"shape {values.shape}" if values.ndim else "a single number"
            raise ValueError(
                f"must give an array with one value of {name} for each of the {time_s.size} times and inputs with "
                f"which it is called, but gives {gives}."
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
