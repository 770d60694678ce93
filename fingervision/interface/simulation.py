"""`fingervision.simulate`: the response of a model, with its effects, to a drive."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.input.driven_model import with_dynamics
from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import History
from fingervision.domain.errors import (
    ArgumentError,
    ArgumentTypeError,
    OutputError,
    UnknownNameError,
)
from fingervision.domain.needed_library import needed_library
from fingervision.domain.parameter import Estimate
from fingervision.domain.response import Response
from fingervision.effects import catalogue
from fingervision.frames.array_levels import what_it_is
from fingervision.interface.argument_checks import path_of, speaks_python
from fingervision.interface.notebook import image_html, png_of_figure
from fingervision.interface.tables import effect_names, model_given
from fingervision.models.function_model import FunctionModel
from fingervision.storage.row_file import write_table

if TYPE_CHECKING:
    import os

    import pandas as pd
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from fingervision.models.corrected import CorrectedModel

SLACK = 1e-9
"""Share of the range of a model by which an input may exceed the range, because of rounding."""


@dataclass(frozen=True, eq=False, repr=False)
class Simulation:
    """Predicted gap, fingers and force along a drive; made by `fingervision.simulate`.

    Parameters
    ----------
    model : str
        Name of the model.
    input_mm : ndarray of float, shape (n,)
        Input of the drive.
    time_s : ndarray of float, shape (n,), or None
        Times; None if the drive has no times.
    run : tuple of str, length n, or None
        Name of the run of each sample; None if the drive has no runs.
    response : Response
        The measuring points.
    """

    model: str
    input_mm: NDArray[np.float64]
    time_s: NDArray[np.float64] | None
    run: tuple[str, ...] | None
    response: Response

    def __len__(self) -> int:
        return self.input_mm.size

    @property
    def gap_mm(self) -> NDArray[np.float64]:
        """Predicted gap, shape (n,)."""
        return self.response.gap_mm

    @property
    def left_mm(self) -> NDArray[np.float64]:
        """Predicted left measuring point, shape (n,); origin at the middle of the fingers at rest."""
        return self.response.left_mm

    @property
    def right_mm(self) -> NDArray[np.float64]:
        """Predicted right measuring point, shape (n,)."""
        return self.response.right_mm

    @property
    def force_n(self) -> NDArray[np.float64] | None:
        """Force at the drive, shape (n,) (N); None if the model predicts no force."""
        return self.response.force_n

    def columns(self) -> dict[str, Any]:
        """Return the columns that `save` writes, by name."""
        columns: dict[str, Any] = {}
        if self.run is not None:
            columns["run"] = list(self.run)
        if self.time_s is not None:
            columns["time_s"] = self.time_s
        columns |= {
            "input_mm": self.input_mm,
            "gap_mm": self.gap_mm,
            "left_mm": self.left_mm,
            "right_mm": self.right_mm,
        }
        if self.force_n is not None:
            columns["force_n"] = self.force_n
        return columns

    def to_dataframe(self) -> "pd.DataFrame":
        """Give the columns as a pandas DataFrame.

        Raises
        ------
        MissingLibraryError
            pandas is not installed (it comes with the extra `dataframe`).
        """
        frame: pd.DataFrame = needed_library("pandas", "dataframe", "to_dataframe").DataFrame(self.columns())
        return frame

    def plot(self, axes: "Axes | None" = None) -> "Axes":
        """Draw the gap over time, or over the input if there are no times.

        Parameters
        ----------
        axes : Axes or None
            Matplotlib axes; None makes a new figure.
        """
        if axes is None:
            import matplotlib.pyplot as plt

            _, axes = plt.subplots(layout="constrained")
        self._draw(axes)
        return axes

    def _draw(self, axes: "Axes") -> None:
        if self.time_s is None:
            order = np.argsort(self.input_mm, kind="stable")
            axes.plot(self.input_mm[order], self.gap_mm[order], label=self.model)
            axes.set_xlabel("input of the stage, mm")
        else:
            for number, rows in enumerate(_runs(self.run, len(self))):
                axes.plot(self.time_s[rows], self.gap_mm[rows], color="C0", label=self.model if number == 0 else None)
            axes.set_xlabel("time, s")
        axes.set_ylabel("gap between the fingertips, mm")
        axes.legend(frameon=False)

    @speaks_python
    def save(self, path: "str | os.PathLike[str]") -> Path:
        """Save the columns as CSV.

        The saved file can be read as a measured table, or as a simulation table.

        Raises
        ------
        OutputError
            The file or folder cannot be written.
        """
        out = path_of("path", path, "a CSV file")
        columns = self.columns()
        try:
            write_table(out, list(columns), zip(*columns.values(), strict=True))
        except OSError as error:
            raise OutputError(f"{out} could not be written ({error.strerror}): name another path.") from error
        return out

    def __repr__(self) -> str:
        gap = self.gap_mm
        return f"Simulation({self.model}, {len(self)} inputs, gap {gap.min():.4f} to {gap.max():.4f} mm)"

    def _repr_html_(self) -> str:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6.3, 3.2), layout="constrained")
        self._draw(figure.subplots())
        return f"<p>{escape(repr(self))}</p>{image_html(png_of_figure(figure))}"


@speaks_python
def simulate(
    model: "str | os.PathLike[str] | CorrectedModel | Any",
    drive: "str | os.PathLike[str] | DriveHistory | ArrayLike | Any",
    *,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    kind: str = "lumped",
    columns: "str | os.PathLike[str] | None" = None,
) -> Simulation:
    """Predict the gap along a drive, by a model with its effects.

    Parameters
    ----------
    model : path, callable, CorrectedModel, Diagnosis, DataFrame or mapping of columns
        A simulation table, gripper.toml, model.toml, FMU or Python file; or a model in memory, which may be a function
        of times (s) and inputs (mm), see `fingervision.diagnose`.
    drive : path, DriveHistory, DataFrame or mapping with time_s and input_mm, or inputs in mm of shape (n,)
        The input over time. An array of inputs has no times, but a model with effects that have memory needs times.
    effects : mapping of str to mapping of str to float, or None
        Effects that are added to the model, each with the values of its parameters.
    kind : str
        Kind of model by which a gripper.toml is computed: stiffness_matrix, lumped or finite_element.
    columns : path or None
        A columns.toml, for tables of other programs.

    Returns
    -------
    Simulation
        The prediction, with one value per input.

    Raises
    ------
    ArgumentError
        There is no input, or an input lies outside the range of the model.
    FingervisionError
        Model or drive cannot be read.

    Examples
    --------
    >>> import fingervision as fv
    >>> table = {"input_mm": [0.0, 1.0], "gap_mm": [1.0, 3.0]}
    >>> fv.simulate(table, [0.0, 0.25, 0.5]).gap_mm
    array([1. , 1.5, 2. ])
    >>> fv.simulate(table, [0.0, 0.25, 0.5], effects={"input_offset": {"offset_mm": 0.1}}).gap_mm
    array([1.2, 1.7, 2.2])
    """
    given: CorrectedModel = model_given(model, kind, columns).value
    if effects:
        given = replace(given, effects={**given.effects, **_stated(effects)})
    time_s, input_mm, run = inputs_given(drive, columns)
    low, high = given.input_range_mm
    slack = SLACK * (high - low) if np.isfinite(high - low) else 0.0
    if input_mm.min() < low - slack or input_mm.max() > high + slack:
        raise ArgumentError(
            "drive",
            f"lie within the model's {low:g} to {high:g} mm",
            f"runs from {input_mm.min():g} to {input_mm.max():g} mm",
            "leave these inputs out, or give a model that covers them",
        )
    if time_s is None:
        timed = [name for name in given.effects if catalogue()[name].needs_times]
        if timed or isinstance(given.base, FunctionModel):
            what = ", ".join(timed) or f"{given.name} is a function of time, which"
            raise ArgumentError("drive", "have times (time_s)", f"has none, and {what} needs them", "give time_s too")
    base = given.base
    if isinstance(base, FunctionModel):
        base = base.at_rest(float(input_mm.min()), float(input_mm.max()))
    rest_mm = float(base.respond(np.zeros(1)).gap_mm[0])
    opening_mm = base.respond(input_mm).gap_mm - rest_mm
    history = History(
        input_mm=input_mm,
        time_s=time_s,
        runs=_runs(run, input_mm.size),
        rest_gap_mm=rest_mm,
        opening_mm=float(np.max(np.abs(opening_mm))),
        closing_mm=float(max(0.0, -np.min(opening_mm))),
        force=base.respond(np.zeros(1)).force_n is not None,
    )
    fixed = {name: {key: each.value for key, each in values.items()} for name, values in given.effects.items()}
    chain = MeasuringChain(base, history, fixed)
    if isinstance(given.base, FunctionModel):
        chain = with_dynamics(chain, given.base, {})
    return Simulation(given.name, input_mm, time_s, run, chain.respond({}))


def _stated(effects: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, Estimate]]:
    """Check the parameters of effects; those that are not stated have their neutral values."""
    found = {}
    for name in effect_names("effects", effects):
        parameters = {parameter.name: parameter for parameter in catalogue()[name].parameters}
        for key in effects[name]:
            if key not in parameters:
                raise UnknownNameError("effects", key, parameters, f"parameters of {name}")
        values = {key: effects[name].get(key, each.neutral) for key, each in parameters.items()}
        if lacking := [key for key, value in values.items() if value is None]:
            raise ArgumentError("effects", f"state {' and '.join(lacking)} of {name}", "does not")
        found[name] = {key: Estimate(float(value), None) for key, value in values.items() if value is not None}
    return found


def inputs_given(
    drive: Any, columns: Any
) -> tuple[NDArray[np.float64] | None, NDArray[np.float64], tuple[str, ...] | None]:
    """Times, inputs and runs of a drive of any accepted type."""
    import os

    from fingervision.interface.column_tables import drive_from_columns
    from fingervision.interface.tables import read_table

    if isinstance(drive, str | os.PathLike):
        drive = read_table(drive, "drive", columns)
    elif isinstance(drive, Mapping) or hasattr(drive, "columns"):
        drive = drive_from_columns(drive)
    if isinstance(drive, DriveHistory):
        return drive.time_s, drive.input_mm, drive.run
    must = "be a drive's file name, DriveHistory, mapping with time_s and input_mm, or numbers in mm of shape (n,)"
    inputs = np.asarray(drive if isinstance(drive, list | tuple | np.ndarray) else None)
    if inputs.dtype.kind not in "fiu":
        raise ArgumentTypeError("drive", must, f"is {what_it_is(drive)}")
    inputs = inputs.astype(np.float64)
    if inputs.ndim != 1 or inputs.size == 0 or not np.all(np.isfinite(inputs)):
        what = f"has shape {inputs.shape}" if inputs.ndim != 1 else "is empty" if not inputs.size else "holds NaN"
        raise ArgumentError("drive", must, what)
    return None, inputs, None


def _runs(run: tuple[str, ...] | None, count: int) -> tuple[slice, ...]:
    if run is None:
        return (slice(0, count),)
    borders = [0, *(at for at in range(1, count) if run[at] != run[at - 1]), count]
    return tuple(slice(a, b) for a, b in pairwise(borders))
