"""`fingervision.model`: what a drawing predicts, by one kind of model or by all kinds."""

import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import (
    ArgumentError,
    FingervisionError,
    InstallationError,
    UsageError,
)
from fingervision.domain.gripper import Gripper
from fingervision.interface.argument_checks import one_of, path_of, speaks_python
from fingervision.models.answer_figures import LINEAR, ModelFigures, Physics
from fingervision.models.elastic_mechanism import MechanismState
from fingervision.models.gripper_figures import gripper_figures, with_unit
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import build_model, disagreements, kinds, small_displacements_alone
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import MECHANISM_MODELS, MechanismModel, mechanism_figures, width_effect
from fingervision.models.physical_gripper import GAP
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import MechanismDrawing, is_mechanism, read_drawing
from fingervision.storage.out_folder import own_folder
from fingervision.storage.row_file import table_text, write_table
from fingervision.storage.simulation_table import POSE, pose_columns

Array = NDArray[np.float64]
Figures = Mapping[str, float | None]

ALL = "all"
_METRES_BELOW_OF_HEIGHT = 1e-4
_ROWS_BETWEEN = 61
"""Number of inputs over the range of a drive; the error of linear interpolation between them is below 1 µm for the
sample gripper."""
_MOST_ROWS = 401
_MECHANISM_KINDS = ("finite_element", "lumped")
_MECHANISM_ROWS, _MOST_MECHANISM_ROWS = 21, 41
_OF_SIZE = 0.02
"""Input that takes the place of the one at yield where no stress is stated, as a share of the drawing's size."""
_OF_YIELD = 0.5
"""Range of inputs without a drive table, in both directions, as a fraction of the input at which the flexures yield."""

_APART = 0.1
"""Relative difference of two kinds of model, beyond their stated errors, from which a message is printed (a
requirement)."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Prediction:
    """What a drawing predicts; made by `fingervision.model`.

    Iterating gives the kinds of model; indexing by a kind gives its table, which every function accepts as a model.

    Parameters
    ----------
    drawing : str
        Name of the drawing.
    figures : mapping of str to mapping of str to float or None
        Numbers of each kind of model (a row of models.csv); the end of a name is its unit.
    tables : mapping of str to mapping of str to ndarray of float, shape (n,)
        Response of each kind of model over the input: the columns of simulation.csv, or of mechanism.csv.
    models : mapping of str to object
        The models themselves.
    refusals : mapping of str to FingervisionError
        Kinds of model that could not be computed.
    warnings : tuple of str
        Where the kinds disagree by more than their errors.
    """

    drawing: str
    figures: Mapping[str, Figures]
    tables: Mapping[str, Mapping[str, Array]]
    models: Mapping[str, Any] = field(repr=False)
    refusals: Mapping[str, FingervisionError] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.tables)

    def __iter__(self) -> Iterator[str]:
        return iter(self.tables)

    def __getitem__(self, kind: str) -> Mapping[str, Array]:
        return self.tables[kind]

    @property
    def input_mm(self) -> Array:
        """Inputs of the tables, shape (n,)."""
        return next(iter(self.tables.values()))["input_mm"]

    def report(self) -> str:
        """Return the figures in a table: one row per quantity, one column per kind of model."""
        return "\n".join([figures_text("", self.figures), *(f"warning: {words}" for words in self.warnings)])

    @speaks_python
    def save(self, folder: "str | os.PathLike[str]") -> Path:
        """Write models.csv and, for each kind in a folder of its own, simulation.csv or mechanism.csv.

        Raises
        ------
        OutputError, UsageError
            The folder cannot be written, or holds the results of another drawing.
        """
        from fingervision.storage.out_folder import out_folder

        out = own_folder(path_of("folder", folder, "a folder"), Path(self.drawing), named=True)
        with out_folder(out):
            (out / "models.csv").write_text(figures_csv(self.figures), encoding="utf-8")
            for kind in self.tables:
                self.write(kind, out / kind)
        return out

    def write(self, kind: str, folder: Path) -> None:
        """Write the table of a kind of model, simulation.csv, into a folder."""
        folder.mkdir(exist_ok=True)
        _write_columns(folder / "simulation.csv", self.tables[kind])

    def __repr__(self) -> str:
        ends = f"{self.input_mm.min():.3g} to {self.input_mm.max():.3g} mm"
        return f"Prediction({self.drawing}: {', '.join(self.tables)}; {self.input_mm.size} inputs, {ends})"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.report())}</pre>"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class GripperPrediction(Prediction):
    """What the drawing of a gripper (gripper.toml) predicts.

    Parameters
    ----------
    stated : mapping of str to ModelFigures
        Figures at zero input of each kind of model, with its errors.
    """

    stated: Mapping[str, ModelFigures] = field(repr=False)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class MechanismPrediction(Prediction):
    """What the drawing of a mechanism (mechanism.toml) predicts.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    states : mapping of str to sequence of MechanismState
        Equilibria over the input, by kind of model.
    """

    figures: Mapping[str, Mapping[str, float]]
    mechanism: Mechanism = field(repr=False)
    states: Mapping[str, Sequence[MechanismState]] = field(repr=False)

    def write(self, kind: str, folder: Path) -> None:
        """Write mechanism.csv, and also simulation.csv if a pair of probes is named gap, into a folder."""
        columns = self.tables[kind]
        folder.mkdir(exist_ok=True)
        _write_columns(folder / "mechanism.csv", columns)
        if "gap_mm" in columns:
            poses = [name for name in columns if "." in name]
            own = {"input_mm": columns["input_mm"], "gap_mm": columns["gap_mm"], **self._sides(kind)}
            own |= {name: columns[name] for name in ("force_n", *poses)}
            _write_columns(folder / "simulation.csv", own)

    def _sides(self, kind: str) -> dict[str, Array]:
        """Positions of the gap's two points along its direction, from the middle at zero input, as in gaps.csv."""
        first, last = self.mechanism.pairs[GAP]
        apart = np.subtract(self.mechanism.probes[last], self.mechanism.probes[first])
        way, states = 0.5 * apart / np.hypot(*apart), self.states[kind]
        middle = np.array([np.add(state.probes_mm[first], state.probes_mm[last]) @ way for state in states])
        half = 0.5 * np.array([state.pairs_mm[GAP] for state in states])
        return {"left_mm": middle - half, "right_mm": middle + half}


def _write_columns(path: Path, columns: Mapping[str, Array]) -> None:
    rows = np.column_stack(list(columns.values())).tolist()
    write_table(path, list(columns), rows)


@speaks_python
def model(
    drawing: "str | os.PathLike[str]",
    *,
    kind: str = ALL,
    drive: Any = None,
    hinge: str = "corrected",
    large_rotation: bool = False,
    contact: bool = False,
    columns: "str | os.PathLike[str] | None" = None,
) -> Prediction:
    """Predict gap, force, stress and vibration from a drawing, with one kind of model or all; write nothing.

    Parameters
    ----------
    drawing : path
        A gripper.toml or a mechanism.toml.
    kind : str
        Kind of model: stiffness_matrix, lumped, finite_element, or all.
    drive : path, DriveHistory, mapping of columns, sequence of float, or None
        Inputs (mm) at which the response is computed; None takes the drawing's range.
    hinge : str
        Hinge compliance: corrected by finite elements, or beam (theory alone).
    large_rotation : bool
        Whether the equilibrium is computed in the deformed shape.
    contact : bool
        Whether the fingers (of a mechanism: its contacts) stop where they touch each other.
    columns : path or None
        A columns.toml, for a drive table of another program.

    Returns
    -------
    Prediction
        Figures and response over the input, by kind of model.

    Raises
    ------
    ArgumentError
        An argument has an impossible value.
    DataError, InputFileError, ModelError
        The drawing cannot be read, or has no solution.

    Examples
    --------
    >>> import fingervision as fv
    >>> found = fv.model("sample_frames/paper/gripper.toml", kind="lumped")
    >>> print(f"{found.figures['lumped']['gap_per_input']:.2f} mm/mm")
    7.72 mm/mm
    """
    from fingervision.interface.simulation import inputs_given

    path = path_of("drawing", drawing, "a gripper.toml or mechanism.toml")
    theory = HingeTheory(one_of("hinge", hinge, [each.value for each in HingeTheory]))
    inputs = None if drive is None else np.unique(inputs_given(drive, columns)[1])
    physics = Physics(large_rotation=large_rotation, contact=contact)
    if is_mechanism(path):
        refuse_beams(path, theory)
        return predict_mechanism(path, read_drawing(path), kind, inputs, physics)
    return predict_gripper(path, read_gripper(path), one_of("kind", kind, (*kinds(), ALL)), inputs, physics, theory)


def refuse_beams(path: Path, theory: HingeTheory) -> None:
    """Refuse beam theory for a mechanism.toml, whose results would be the same with it."""
    if theory is HingeTheory.BEAM:
        raise UsageError(
            f"--hinge beam is for a gripper.toml, but {path} is a mechanism.toml, whose flexures are always corrected "
            "by finite elements: leave out --hinge."
        )


def predict_gripper(
    path: Path, gripper: Gripper, kind: str, inputs: Array | None, physics: Physics, theory: HingeTheory
) -> GripperPrediction:
    """Compute one or all kinds of model of a gripper; if one of several fails, the others are still computed.

    Raises
    ------
    FingervisionError
        No kind of model can be computed, or the inputs cannot be millimetres.
    """
    if inputs is not None:
        inputs = _checked_inputs(inputs, gripper)
    rows: dict[str, dict[str, float | None]] = {}
    tables: dict[str, dict[str, Array]] = {}
    stated: dict[str, ModelFigures] = {}
    models: dict[str, Any] = {}
    refusals: dict[str, FingervisionError] = {}
    for name in kinds() if kind == ALL else (kind,):
        began = time.perf_counter()
        own = LINEAR if kind == ALL and small_displacements_alone(name) else physics
        try:
            built = build_model(name, gripper, own, theory)
            figures = built.figures()
            given = inputs
            if given is None:
                given = _inputs_until_touch(figures)
            elif physics != LINEAR and not models:
                given = _with_rows_between(given, figures)
            answer = built.respond(given)
            row = gripper_figures(gripper, built, given, figures)
            row |= width_effect(built.elastic) if isinstance(built, DrawnGripper) else {}
        except FingervisionError as error:
            if kind != ALL:
                raise
            refusals[name] = error
            continue
        inputs, models[name], stated[name] = given, built, figures
        rows[name] = {**row, "seconds": round(time.perf_counter() - began, 3)}
        force = {} if answer.force_n is None else {"force_n": answer.force_n}
        # A model from a plug-in need not provide the position of each body.
        poses = built.body_poses(given) if hasattr(built, "body_poses") else {}
        tables[name] = {
            "input_mm": given, "gap_mm": answer.gap_mm, "left_mm": answer.left_mm, "right_mm": answer.right_mm,
            **force, **pose_columns(poses),
        }  # fmt: skip
    if not rows:
        raise next(iter(refusals.values()))
    return GripperPrediction(
        drawing=str(path), figures=rows, tables=tables, models=models, refusals=refusals,
        warnings=tuple(disagreements(stated)), stated=stated,
    )  # fmt: skip


def _checked_inputs(inputs: Array, gripper: Gripper) -> Array:
    """Refuse inputs in another unit than mm, and leave at most `_MOST_ROWS`."""
    largest = float(np.abs(inputs).max())
    if 0.0 < largest < _METRES_BELOW_OF_HEIGHT * gripper.body.height_mm:
        raise UsageError(
            f"The inputs of --drive must be millimetres, but the largest is {largest:g} for a gripper of "
            f"{gripper.body.height_mm:g} mm: are they metres? Multiply the column input_mm by 1000."
        )
    if largest > gripper.body.height_mm:
        raise UsageError(
            f"The inputs of --drive must be millimetres, but the largest is {largest:g} for a gripper of "
            f"{gripper.body.height_mm:g} mm: are they micrometres? Divide the column input_mm by 1000."
        )
    _at_least_two(inputs)
    return inputs if inputs.size <= _MOST_ROWS else np.linspace(inputs[0], inputs[-1], _MOST_ROWS)


def _at_least_two(inputs: Array) -> None:
    if inputs.size < 2:
        raise UsageError(f"--drive must hold at least two different inputs, but holds {inputs.size}.")


def _with_rows_between(inputs: Array, figures: ModelFigures) -> Array:
    """Add inputs between those of a drive table and at the first touch: a table is linear between its rows."""
    low, high = float(inputs.min()), float(inputs.max())
    touch = figures.contact_input_mm
    bends = [touch] if touch is not None and low < touch < high else []
    return np.union1d(inputs, np.concatenate([np.linspace(low, high, _ROWS_BETWEEN), bends]))


def _inputs_until_touch(figures: ModelFigures) -> Array:
    """Inputs (mm) from the first touch (closing) to three times this amount in opening: the published range."""
    touch = figures.contact_input_mm or -0.1
    return np.union1d(np.linspace(touch, 0.0, 26), np.linspace(0.0, -3.0 * touch, 76))


def predict_mechanism(
    path: Path, drawing: MechanismDrawing, kind: str, driven: Array | None, physics: Physics
) -> MechanismPrediction:
    """Compute one or both kinds of model of a mechanism; if one of them fails, the other is still computed.

    Raises
    ------
    UsageError
        The drawing cannot be computed as asked.
    FingervisionError
        No kind of model can be computed.
    """
    with naming(path):
        mechanism = drawing.mechanism()
    if physics.contact and not mechanism.contacts:
        raise UsageError(f"--contact needs a [[contact]] section that says which faces may touch, but {path} has none.")
    if kind not in (*_MECHANISM_KINDS, "stiffness_matrix", ALL):
        raise UsageError(
            f"A mechanism.toml can be computed by the kinds of model {', '.join(_MECHANISM_KINDS)}, but --kind is "
            f"{kind}."
        )
    models: dict[str, MechanismModel] = {}
    figures: dict[str, dict[str, float]] = {}
    refusals: dict[str, FingervisionError] = {}
    for name in _MECHANISM_KINDS if kind == ALL else (kind,):
        try:
            with naming(path):
                built = MECHANISM_MODELS[name](mechanism)
                figures[name] = mechanism_figures(built) | width_effect(built)
        except FingervisionError as error:
            refusals[name] = error
        else:
            models[name] = built
    if not models:
        raise next(iter(refusals.values()))
    chief = next(iter(models))
    at_yield_mm = figures[chief].get("input_at_yield_mm", _OF_SIZE * mechanism.region.size_mm)
    at_yield_mm = min(at_yield_mm, abs(figures[chief].get("input_at_buckling_mm", at_yield_mm)))
    touching = models[chief].touch_input_mm().values() if physics.contact and driven is not None else ()
    inputs = _mechanism_inputs(driven, at_yield_mm, touching, is_curved=physics != LINEAR)
    states = {
        name: [each.state(float(x), large_rotation=physics.large_rotation, contact=physics.contact) for x in inputs]
        for name, each in models.items()
    }
    tables = {name: _mechanism_columns(rows) for name, rows in states.items()}
    return MechanismPrediction(
        drawing=str(path), figures=figures, tables=tables, models=models, refusals=refusals, mechanism=mechanism,
        states=states, warnings=tuple(_disagreements(figures)) if len(figures) > 1 else (),
    )  # fmt: skip


def _disagreements(table: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Sentences on quantities in which the second kind of model differs from the first by more than the model errors.

    Differences of motions of probes and pairs are taken relative to the largest motion, because the relative error of a
    very small motion has no meaning.
    """
    (first, ours), (second, theirs) = list(table.items())[:2]
    stated = sum(figures["model_error_force_percent"] for figures in (ours, theirs)) / 100.0
    motions = [label for label in ours if label.endswith("per input [mm/mm]") and label in theirs]
    largest = max((abs(ours[label]) for label in motions), default=0.0)
    found = []
    for label in ("input_stiffness_n_mm", "mode_1_drive_free_hz", "mode_1_drive_held_hz", *motions):
        if label not in ours or label not in theirs:
            continue
        scale = largest if label in motions else abs(ours[label])
        apart = (theirs[label] - ours[label]) / scale if scale else 0.0
        if abs(apart) > _APART + stated:
            of = " of the largest motion" if label in motions else ""
            found.append(
                f"In {label}, {second} differs from {first} by {100.0 * apart:.3g} %{of}, but their model errors "
                f"together explain only {100.0 * stated:.2g} %; trust {first}."
            )
    return found


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the name of the drawing's file to the message of an error that is raised in the `with` block."""
    try:
        yield
    except FingervisionError as error:
        if str(path) in str(error) or isinstance(error, ArgumentError | InstallationError):
            raise
        raise type(error)(f"In {path}: {error}") from error


def _mechanism_inputs(driven: Array | None, at_yield_mm: float, touching: Iterable[float], *, is_curved: bool) -> Array:
    """Inputs of the static table (mm): those of the drive table, or enough evenly spaced inputs for a smooth curve."""
    if driven is None:
        return np.linspace(-_OF_YIELD, _OF_YIELD, _MECHANISM_ROWS) * at_yield_mm
    _at_least_two(driven)
    inputs = driven
    if driven.size > _MOST_MECHANISM_ROWS:
        inputs = np.linspace(driven[0], driven[-1], _MOST_MECHANISM_ROWS)
    if not is_curved:
        return inputs
    # A table is interpolated linearly between its rows, but these results are curved.
    touches = [at for at in touching if inputs[0] < at < inputs[-1]]
    return np.union1d(inputs, np.concatenate([np.linspace(inputs[0], inputs[-1], _MECHANISM_ROWS), touches]))


def _mechanism_columns(states: Sequence[MechanismState]) -> dict[str, Array]:
    """Columns of mechanism.csv."""
    first = states[0]
    columns: dict[str, list[float]] = {"input_mm": [s.input_mm for s in states], "force_n": [s.force_n for s in states]}
    if len(first.drives_n) > 1:
        columns |= {f"{name}_force_n": [s.drives_n[name] for s in states] for name in first.drives_n}
    for name in first.probes_mm:
        for place, axis in enumerate("xy"):
            columns[f"{name}_{axis}_mm"] = [s.probes_mm[name][place] for s in states]
    for name in first.pairs_mm:
        columns[f"{name}_mm"] = [s.pairs_mm[name] for s in states]
    for name in first.contact_n:
        columns[f"{name}_contact_n"] = [s.contact_n[name] for s in states]
    columns["stress_mpa"] = [s.stress_mpa for s in states]
    for name in first.bodies:
        columns |= {f"{name}.{part}": [getattr(s.bodies[name], part) for s in states] for part in POSE}
    return {name: np.asarray(values) for name, values in columns.items()}


def figures_csv(figures: Mapping[str, Figures]) -> str:
    """Text of models.csv: one line per kind of model, with empty cells for results that a kind does not compute."""
    names = list(dict.fromkeys(name for row in figures.values() for name in row))
    return table_text(["kind", *names], ([kind, *map(row.get, names)] for kind, row in figures.items()), digits=7)


def figures_text(name: str, figures: Mapping[str, Figures], *, digits: int = 5, least: int = 0) -> str:
    """Table of results: one row per quantity, one column per kind of model."""
    labels = list(dict.fromkeys(label for row in figures.values() for label in row))
    shown = [with_unit(label) for label in labels]
    width = max(least, *map(len, (*shown, name)))
    lines = [f"{name:<{width}}" + "".join(f"{kind:>18}" for kind in figures)]
    for label, words in zip(labels, shown, strict=True):
        cells = ("-" if (x := row.get(label)) is None else f"{x:.{digits}g}" for row in figures.values())
        lines.append(f"{words:<{width}}" + "".join(f"{cell:>18}" for cell in cells))
    return "\n".join(lines)
