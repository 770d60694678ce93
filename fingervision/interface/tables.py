"""Tables and models from a file or from memory, for every function that takes one."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, overload

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ArgumentTypeError, FingervisionError, OutputError, UnknownNameError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.frames.array_levels import what_it_is
from fingervision.interface.argument_checks import one_of, path_of, speaks_python
from fingervision.interface.column_tables import columns_of, measured_from_columns, simulation_from_columns
from fingervision.interface.measurement import Measurement
from fingervision.models.corrected import CorrectedModel
from fingervision.models.function_model import FunctionModel, model_file
from fingervision.models.kinds import kinds
from fingervision.models.table import TableModel
from fingervision.tables import read as tables
from fingervision.tables.followed_channel import followed_channel
from fingervision.tables.mapping import NAME, entry_for

TABLES = ("measured", "drive", "simulation")
IN_MEMORY = Path("in memory")
"""Folder in the names of tables and models that have no file."""


@overload
def read_table(
    path: "str | os.PathLike[str]",
    kind: Literal["measured"] = "measured",
    columns: "str | os.PathLike[str] | None" = None,
) -> MeasuredTable: ...


@overload
def read_table(
    path: "str | os.PathLike[str]", kind: Literal["drive"], columns: "str | os.PathLike[str] | None" = None
) -> DriveHistory: ...


@overload
def read_table(
    path: "str | os.PathLike[str]", kind: Literal["simulation"], columns: "str | os.PathLike[str] | None" = None
) -> TableModel: ...


@speaks_python
def read_table(
    path: "str | os.PathLike[str]",
    kind: str = "measured",
    columns: "str | os.PathLike[str] | None" = None,
) -> MeasuredTable | DriveHistory | TableModel:
    """Read a table of any program; format, columns and units are recognised, or an error asks for them.

    Parameters
    ----------
    path : path
        The table.
    kind : str
        Kind of table: measured, drive or simulation.
    columns : path or None
        A columns.toml (`fingervision table FILE` writes one); None takes a columns.toml in the folder of the table, if
        there is one.

    Returns
    -------
    MeasuredTable, DriveHistory or TableModel
        The table, of the type that belongs to `kind`.

    Raises
    ------
    OpenQuestionError
        The table can be read in more than one way; the message says how to decide which.
    DataError, InputFileError
        The table cannot be read, or its content cannot be used.

    Examples
    --------
    >>> import fingervision as fv
    >>> table = fv.read_table("sample_frames/paper_run/measured.csv")
    >>> table.gap_mm.shape
    (17,)
    """
    file = path_of("path", path, "a table's file")
    choice = None if columns is None else path_of("columns", columns, "a columns.toml")
    kind = one_of("kind", kind, TABLES)
    if kind == "drive":
        return tables.read_drive(file, choice)
    if kind == "simulation":
        return tables.read_simulation_table(file, choice)
    return tables.read_measured_table(file, choice)


@speaks_python
def read_model(
    path: "str | os.PathLike[str]", kind: str = "lumped", columns: "str | os.PathLike[str] | None" = None
) -> CorrectedModel:
    """Read a model: a simulation table, gripper.toml, model.toml, an FMU, or a Python file.

    Parameters
    ----------
    path : path
        The file.
    kind : str
        Kind of model by which a gripper.toml is computed: stiffness_matrix, lumped or finite_element.
    columns : path or None
        A columns.toml for a simulation table.

    Raises
    ------
    DataError, InputFileError, ModelError, UsageError
        The file cannot be read.

    Examples
    --------
    >>> import fingervision as fv
    >>> fv.read_model("sample_frames/paper/gripper.toml").name
    'gripper.toml (lumped)'
    """
    choice = None if columns is None else path_of("columns", columns, "a columns.toml")
    return tables.read_model(model_file(path_of("path", path, "a model's file")), one_of("kind", kind, kinds()), choice)


@dataclass(frozen=True, slots=True, eq=False)
class Given:
    """A measured table or model given as an argument, with the file it came from.

    Parameters
    ----------
    value : MeasuredTable or CorrectedModel
        The table or the model.
    path : Path
        The file; for a table or model in memory, a name that is the same for the same content.
    """

    value: Any
    path: Path

    def files(self, role: str, columns: Any = None) -> dict[str, Path]:
        """Files on which the numbers depend, by role: the file, the base of a corrected model, and the columns.toml."""
        found = {role: self.path}
        base = getattr(self.value, "base_path", "")
        if base and Path(base).resolve() != self.path.resolve():
            found[f"{role}, base"] = Path(base)
        chosen = None if columns is None else Path(columns)
        for path in tuple(found.values()):
            if path.suffix not in (".toml", ".py", ".fmu") and not entry_for(path, None, chosen).says_nothing:
                found[f"{role}, columns"] = chosen or path.parent / NAME
        return found


def followed_given(measured: Any, model: Any) -> str:
    """Name of the channel that stands for the gap where one of two files has none; else empty.

    Raises
    ------
    FingervisionError
        A file cannot be read.
    """
    are_files = all(isinstance(each, str | os.PathLike) for each in (measured, model))
    return followed_channel(Path(measured), Path(model)) if are_files else ""


def measured_given(measured: Any, columns: Any = None, followed: str = "") -> Given:
    """Interpret an argument as a measured table: a file, a measurement with a drive, a MeasuredTable, or columns.

    Raises
    ------
    ArgumentTypeError
        The argument is not a table.
    DataError, InputFileError, OpenQuestionError
        The table cannot be read, or its content cannot be used.
    """
    if isinstance(measured, str | os.PathLike):
        path = path_of("measured", measured, "a measured table's file")
        if followed:
            return Given(tables.read_measured_table(path, followed=followed), path)
        return Given(read_table(path, "measured", columns), path)
    if isinstance(measured, MeasuredTable):
        table = measured
    elif isinstance(measured, Measurement):
        table = measured.measured_table()
    else:
        table = measured_from_columns(measured)
    return Given(table, _name_of("table", table.input_mm, table.gap_mm))


def model_given(model: Any, kind: str, columns: Any = None, followed: str = "") -> Given:
    """Interpret an argument as a model: a file, a function, a CorrectedModel, a Diagnosis, or columns of a table.

    Raises
    ------
    ArgumentTypeError
        The argument is not a model.
    DataError, InputFileError, ModelError, UsageError
        The file cannot be read.
    """
    if isinstance(model, str | os.PathLike):
        path = model_file(path_of("model", model, "a model's file"))
        if followed:
            return Given(tables.read_model(path, one_of("kind", kind, kinds()), followed=followed), path)
        return Given(read_model(path, kind, columns), path)
    model = getattr(model, "corrected_model", model)
    if callable(model):
        called = getattr(model, "__name__", type(model).__name__)
        base = FunctionModel(Path(called), function=model)
        return Given(CorrectedModel(called, base, "", (-np.inf, np.inf), {}), IN_MEMORY / called)
    if isinstance(model, TableModel):
        path = _name_of("simulation", model.input_mm, model.left_mm, model.right_mm)
        return Given(CorrectedModel(model.name, model, "", model.input_range_mm, {}), path)
    if isinstance(model, CorrectedModel):
        return Given(model, Path(model.base_path) if model.base_path else IN_MEMORY / model.name)
    must = (
        "a model's file name, a function of times and inputs, CorrectedModel, Diagnosis, DataFrame or mapping with "
        "input_mm and gap_mm"
    )
    if isinstance(model, np.ndarray) or not (isinstance(model, Mapping) or hasattr(model, "columns")):
        raise ArgumentTypeError("model", f"be {must}", f"is {what_it_is(model)}")
    return model_given(simulation_from_columns(columns_of("model", model, must)), kind)


def models_given(model: Any, kind: str, columns: Any = None, followed: str = "") -> dict[str, Given]:
    """Interpret an argument as one or more models: one, a list, or a mapping by name; each as in `model_given`.

    Raises
    ------
    UsageError
        No model is given, or the same model is given twice.
    """
    if isinstance(model, Mapping) and "input_mm" not in model:
        named = {str(name): model_given(each, kind, columns) for name, each in model.items()}
    else:
        listed = list(model) if isinstance(model, list | tuple) else [model]
        given = [model_given(each, kind, columns, followed) for each in listed]
        named = dict(zip(told_apart([each.path for each in given]), given, strict=True)) if given else {}
    if not named:
        raise ArgumentTypeError("model", "be at least one model", "is none")
    return named


def told_apart(paths: list[Path]) -> list[str]:
    """Name models by their files, with as much of the folder's name as is needed to distinguish them.

    Raises
    ------
    UsageError
        The same file is named twice.
    """
    from fingervision.domain.errors import UsageError

    for parts in range(1, max(len(path.parts) for path in paths) + 1):
        names = [Path(*path.parts[-parts:]).as_posix() for path in paths]
        if len(set(names)) == len(names):
            return names
    raise UsageError("--model names the same file twice: name each model only once.")


def effect_names(argument: str, names: Any) -> frozenset[str]:
    """Check that names are those of effects in the catalogue.

    Raises
    ------
    UnknownNameError
        The catalogue has no such effect.
    """
    from fingervision.effects import catalogue

    listed = (names,) if isinstance(names, str) else tuple(names)
    for name in listed:
        if name not in catalogue():
            what = "an effect of the catalogue"
            raise UnknownNameError(argument, str(name), catalogue(), what, "`fingervision effects` lists them")
    return frozenset(listed)


def own_base(model: CorrectedModel, out: Path, at_rest: Any = None) -> CorrectedModel:
    """Save a model that is in memory to a file, to which a corrected model can refer; other models stay unchanged.

    Parameters
    ----------
    model : CorrectedModel
        The model.
    out : Path
        An existing folder.
    at_rest : TableModel or None
        Response at rest of a model that is a function. The function itself cannot be saved; the file says so.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    is_function = isinstance(model.base, FunctionModel) and model.base.function is not None
    base = at_rest if is_function else model.base
    if model.base_path or not isinstance(base, TableModel):
        return model
    from fingervision.storage.simulation_table import write_simulation

    path = out / "simulation.csv"
    words = f"Response at rest of the function {model.name}; its motion over time is not in this table."
    try:
        write_simulation(path, base.input_mm, base.respond(base.input_mm), comment=words if is_function else "")
    except FingervisionError:
        raise
    except OSError as error:
        raise OutputError(f"{path} could not be written ({error.strerror}): name another folder.") from error
    return replace(model, base_path=str(path))


def _name_of(what: str, *columns: Any) -> Path:
    whole = hashlib.sha256()
    for column in columns:
        whole.update(np.ascontiguousarray(column).tobytes())
    return IN_MEMORY / f"{what}-{whole.hexdigest()[:12]}"
