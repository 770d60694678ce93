"""The file model.toml of a corrected model, and the choice of the reader for each kind of model file."""

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from fingervision.domain.effect import curve_points, curve_values, effect_key, split_key
from fingervision.domain.errors import DataError, InputFileError
from fingervision.domain.field import Field
from fingervision.domain.parameter import Estimate
from fingervision.effects import catalogue, origin_of
from fingervision.models.corrected import CorrectedModel
from fingervision.models.function_model import SUFFIXES, FunctionModel
from fingervision.models.kinds import kinds
from fingervision.models.physical_gripper import MechanismModelOfGap, PhysicalGripper
from fingervision.models.table import TableModel
from fingervision.plugins.origin import SESSION
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import is_mechanism, read_mechanism
from fingervision.storage.plain_file import in_utf8, toml_lines
from fingervision.storage.simulation_table import read_simulation_table
from fingervision.storage.toml_section import Section, read_section

FOLLOWED = "gap"
FMU_KEYS = ("input", FOLLOWED, "input_unit", "gap_unit")
"""Keys of an FMU: names of its input and gap, and their units where the FMU declares none. For the drawing of a
mechanism, `gap` is the displacement of a body that stands for the gap."""
POINTS = "points"
"""Key of the curve of a position error map: pairs of input and error, in mm."""
# A fitted value at a bound may exceed the bound by a rounding error.
BOUND_SLACK = 1e-6


def read_model(
    path: Path,
    kind: str = "lumped",
    inside: tuple[Path, ...] = (),
    table: Callable[[Path], TableModel] = read_simulation_table,
    followed: str = "",
) -> CorrectedModel:
    """Read a model: a simulation table or a gripper drawing (without effects), or a corrected model.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Kind of model that is built from a gripper drawing.
    inside : tuple of Path
        Corrected models that have this model as their base.
    table : callable
        Function that reads simulation tables; by default, only tables in fingervision's own format can be read.
    followed : str
        Displacement of a body that stands for the gap of a mechanism, such as `lever.y_mm`; empty for the gap itself.

    Raises
    ------
    DataError, InputFileError, ModelError, UsageError
        The file is not a model of any supported format, or the base of a corrected model is missing.
    """
    if path.suffix.lower() in SUFFIXES:
        return _function(path, {})
    if path.suffix.lower() != ".toml":
        simulation = table(path)
        return CorrectedModel(simulation.name, simulation, str(path), simulation.input_range_mm, {})
    top = read_section(path, "model")
    if "base" not in top.values:
        return _gripper(path, kind, followed)
    top.schema(1, 1)
    place = path.resolve()
    if place in inside:
        top.refuse("base", "must be another model, but is the file itself or a model based on it: correct it.")
    named = top.word("base")
    if not named.strip() or "\0" in named:
        top.refuse("base", f"must be the name of a file, but is {named!r}: correct it.")
    names = {key: top.word(key) for key in FMU_KEYS if key in top.values}
    of_body = names.get(FOLLOWED, followed)
    base = read_model(path.parent / named, top.word("kind", kind), (*inside, place), table, of_body)
    if names and isinstance(base.base, FunctionModel):
        base = replace(base, base=FunctionModel(base.base.path, {**base.base.names, **names}))
    effects = {**base.effects, **dict(map(_effect, top.tables("effect")))}
    return CorrectedModel(base.name, base.base, base.base_path, base.input_range_mm, effects, base.kind)


def _effect(section: Section) -> tuple[str, dict[str, Estimate]]:
    """Read an effect: its key and parameters; refuse one that is not known here."""
    name, origin = section.word("name"), section.word("from", "")
    if name not in catalogue() and origin:
        advice = f"add `--effects {origin}`" if origin.endswith(".py") else f"install {origin}"
        if origin == str(SESSION):
            advice = "register it with @fingervision.effect, or keep it in a file for --effects"
        section.refuse("name", f"must be an effect that is installed here, but {name} from {origin} is not: {advice}.")
    stated = section.table("parameters")
    known = {each.name: each for each in catalogue()[section.word("name", of=catalogue())].parameters}
    values: dict[str, Estimate] = {}
    for key, parameter in known.items():
        slack = BOUND_SLACK * (parameter.upper - parameter.lower)
        bounds = Field(unit=parameter.unit, low=parameter.lower - slack, high=parameter.upper + slack)
        values[key] = Estimate(*stated.uncertain(key, bounds))
    values |= {key: Estimate(*stated.uncertain(key, Field())) for key in stated.values if key not in (*known, POINTS)}
    inputs, errors = stated.array(POINTS, (-1, 2)).T if stated.values.get(POINTS) else np.zeros((2, 0))
    if inputs.size == 1 or np.any(np.diff(inputs) <= 0.0):
        stated.refuse(POINTS, f"must be two or more pairs with rising inputs, but the inputs are {inputs.tolist()}.")
    values |= {key: Estimate(value, None) for key, value in curve_values(inputs.tolist(), errors.tolist()).items()}
    return effect_key(name, section.word("place", ""), section.word("end", "")), values


def _function(path: Path, names: Mapping[str, str]) -> CorrectedModel:
    """Read an FMU or a Python file as a model that accepts any input."""
    if not path.is_file():
        raise InputFileError(f"There is no model {path}.")
    everywhere = (-float("inf"), float("inf"))
    return CorrectedModel(path.name, FunctionModel(path, names), str(path), everywhere, {})


def _gripper(path: Path, kind: str, followed: str) -> CorrectedModel:
    """Build a gripper model that computes mechanism effects by physical laws."""
    if kind not in kinds():
        raise DataError(f"The kind of model for {path} must be one of {', '.join(kinds())}, but is {kind}: choose one.")
    if is_mechanism(path):
        drawn = MechanismModelOfGap(read_mechanism(path), kind, followed)
        return CorrectedModel(f"{path.name} ({kind})", drawn, str(path), drawn.input_range_mm, {}, kind)
    gripper = PhysicalGripper(read_gripper(path), kind)
    return CorrectedModel(f"{path.name} ({kind})", gripper, str(path), gripper.input_range_mm, {}, kind)


def write_model(
    path: Path,
    base_path: Path,
    effects: Mapping[str, Mapping[str, Estimate]],
    kind: str | None = None,
    names: Mapping[str, str] | None = None,
) -> None:
    """Write a corrected model; the base model's path is relative to the file, and `names` are the keys of an FMU.

    Raises
    ------
    OutputError
        The name of the base model cannot be written in UTF-8, the encoding of TOML files.
    """
    base = Path(os.path.relpath(base_path.resolve(), path.parent.resolve())).as_posix()
    lines = toml_lines({"schema": 1, "base": base, "kind": kind, **(names or {})})
    for name, parameters in effects.items():
        effect, place, end = split_key(name)
        # To read the file, an effect that is not built in must be available.
        origin = origin_of(effect) if effect in catalogue() else None
        source = None if origin is None or origin.built_in else str(origin)
        lines += toml_lines({"name": effect, "place": place or None, "end": end or None, "from": source}, "[[effect]]")
        inputs, errors = curve_points({key: estimate.value for key, estimate in parameters.items()})
        pairs = [list(pair) for pair in zip(inputs.tolist(), errors.tolist(), strict=True)]
        stated = {
            key: {"value": estimate.value} | ({} if estimate.u is None else {"u": estimate.u})
            for key, estimate in parameters.items()
            if not key.startswith("point_")
        }
        lines += ["[effect.parameters]", *toml_lines({POINTS: pairs or None, **stated})]
    path.write_text(in_utf8(path, "\n".join(lines) + "\n"), encoding="utf-8")
