"""The file model.toml of a corrected model, and the choice of the reader for each kind of model file."""

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from fingervision.domain.effect import effect_key, split_key
from fingervision.domain.errors import DataError, InputFileError
from fingervision.domain.parameter import Estimate
from fingervision.effects import catalogue, origin_of
from fingervision.effects.position_error_map import curve_points, curve_values
from fingervision.models.corrected import CorrectedModel
from fingervision.models.drawn_mechanism import MechanismModelOfGap
from fingervision.models.function_model import SUFFIXES, FunctionModel
from fingervision.models.kinds import kinds
from fingervision.models.physical_gripper import PhysicalGripper
from fingervision.models.table import TableModel
from fingervision.plugins.origin import SESSION
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import is_mechanism, read_mechanism
from fingervision.storage.plain_file import in_utf8
from fingervision.storage.simulation_table import read_simulation_table
from fingervision.storage.toml_section import read_document
from fingervision.storage.toml_text import toml_lines

FMU_KEYS = ("input", "gap", "input_unit", "gap_unit")
"""Keys of an FMU: names of its input and gap, and their units where the FMU declares none."""
POINTS = "points"
"""Key of the curve of a position error map: pairs of input and error, in mm."""
# A fitted value at a bound may exceed the bound by a rounding error.
BOUND_SLACK = 1e-6


def read_model(
    path: Path,
    kind: str = "lumped",
    inside: tuple[Path, ...] = (),
    table: Callable[[Path], TableModel] = read_simulation_table,
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
    document, _ = read_document(path, "model")
    if "base" not in document:
        return _gripper(path, kind)
    if document.get("schema", 1) != 1:
        raise DataError(
            f"schema in {path} must be 1, but is {document['schema']!r}: the file was written by a newer "
            "fingervision; update this one."
        )
    place = path.resolve()
    if place in inside:
        raise DataError(
            f"The base of {path} must be another model, but is the file itself or a model based on it: correct `base`."
        )
    kind = str(document.get("kind", kind))
    named = document["base"]
    if not (isinstance(named, str) and named.strip() and "\0" not in named):
        raise DataError(f"The base in {path} must be the name of a file, but is {named!r}: correct it.")
    base = read_model(path.parent / named, kind, (*inside, place), table)
    names: dict[str, str] = {key: str(document[key]) for key in FMU_KEYS if key in document}
    if names and isinstance(base.base, FunctionModel):
        base = replace(base, base=FunctionModel(base.base.path, {**base.base.names, **names}))
    effects: dict[str, Mapping[str, Estimate]] = dict(base.effects)
    origins: dict[str, str] = {}
    entries = document.get("effect", [])
    if not isinstance(entries, list):
        raise DataError(f"The effects in {path} must be [[effect]] tables, but `effect` is {entries}: correct it.")
    for entry in entries:
        try:
            parameters = dict(entry["parameters"])
            points = [(float(at), float(error)) for at, error in parameters.pop(POINTS, [])]
            stated = {
                name: Estimate(float(value["value"]), float(value["u"]) if "u" in value else None)
                for name, value in parameters.items()
            }
            curve = curve_values([at for at, _ in points], [error for _, error in points])
            key = effect_key(str(entry["name"]), str(entry.get("place", "")), str(entry.get("end", "")))
            origins[key] = str(entry.get("from", ""))
            effects[key] = stated | {name: Estimate(value, None) for name, value in curve.items()}
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise DataError(
                f"An effect in {path} must have a name and parameters like play_mm = {{ value = 0.01, u = 0.001 }}, "
                f"but is {entry}: correct it."
            ) from error
    for key, values in effects.items():
        name = split_key(key)[0]
        _check(name, values, path, origins.get(key, ""))
        _check_curve(name, values, path)
    return CorrectedModel(base.name, base.base, base.base_path, base.input_range_mm, effects, base.kind)


def _function(path: Path, names: Mapping[str, str]) -> CorrectedModel:
    """Read an FMU or a Python file as a model that accepts any input."""
    if not path.is_file():
        raise InputFileError(f"There is no model {path}.")
    everywhere = (-float("inf"), float("inf"))
    return CorrectedModel(path.name, FunctionModel(path, names), str(path), everywhere, {})


def _check(name: str, values: Mapping[str, Estimate], path: Path, origin: str) -> None:
    """Refuse an unknown effect, or an effect with a missing parameter; `origin` states where the effect came from."""
    if name not in catalogue() and origin:
        advice = f"add `--effects {origin}`" if origin.endswith(".py") else f"install {origin}"
        if origin == str(SESSION):
            advice = "register it with @fingervision.effect, or keep it in a file for --effects"
        raise DataError(
            f"The effect {name} in {path} must be installed here, but is not; it came from {origin}: {advice}."
        )
    if name not in catalogue():
        near = get_close_matches(name, catalogue(), n=1)
        hint = f"did you mean {near[0]}?" if near else "`fingervision effects` lists them."
        raise DataError(f"An effect in {path} must be one of the catalogue, but is {name}: {hint}")
    wanted = [parameter.name for parameter in catalogue()[name].parameters]
    missing = [key for key in wanted if key not in values]
    if missing:
        raise DataError(
            f"The effect {name} in {path} must state {', '.join(wanted)}, but {', '.join(missing)} is not there "
            f"(it states {', '.join(values) or 'nothing'}): add it."
        )
    for parameter in catalogue()[name].parameters:
        estimate = values[parameter.name]
        slack = BOUND_SLACK * (parameter.upper - parameter.lower)
        if not parameter.lower - slack <= estimate.value <= parameter.upper + slack:
            raise DataError(
                f"{parameter.name} of the effect {name} in {path} must be {parameter.lower:g} to {parameter.upper:g}, "
                f"but is {estimate.value:g}: correct it."
            )
        if estimate.u is not None and not 0.0 <= estimate.u < float("inf"):
            raise DataError(
                f"The standard uncertainty u of {parameter.name} of the effect {name} in {path} must be a finite "
                f"number that is not negative, but is {estimate.u:g}: correct it, or leave it out."
            )


def _check_curve(name: str, values: Mapping[str, Estimate], path: Path) -> None:
    """Refuse a curve with invalid or too few points, or with points that are not sorted by input."""
    inputs, errors = curve_points({key: estimate.value for key, estimate in values.items()})
    if inputs.size and not (
        inputs.size > 1
        and np.all(np.isfinite(inputs))
        and np.all(np.isfinite(errors))
        and np.all(np.diff(inputs) > 0.0)
    ):
        raise DataError(
            f"{POINTS} of the effect {name} in {path} must be two or more pairs of finite numbers with rising inputs, "
            f"but the inputs are {inputs.tolist()}: correct them."
        )


def _gripper(path: Path, kind: str) -> CorrectedModel:
    """Build a gripper model that computes mechanism effects by physical laws."""
    if kind not in kinds():
        raise DataError(f"The kind of model for {path} must be one of {', '.join(kinds())}, but is {kind}: choose one.")
    if is_mechanism(path):
        drawn = MechanismModelOfGap(read_mechanism(path), kind)
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
