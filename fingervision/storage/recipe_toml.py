"""The file recipe.toml: the steps that the test bed executes."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from fingervision.domain.recipe import Recipe
from fingervision.storage.toml_section import Section, read_document

SCHEMA = 1
BELOW_FORCE_N = 5.0


def read_recipe(path: Path) -> Recipe[Section]:
    """Read a recipe; the settings of each step are read by the step's kind.

    Raises
    ------
    DataError, InputFileError
        The file does not exist, is not TOML, has a newer schema, has no step, or has an unknown key.
    """
    document, text = read_document(path, "recipe")
    top = Section(path, text, "", document)
    top.only(("schema", "name", "below_force_n", "step"))
    if top.whole("schema", low=1) > SCHEMA:
        top.refuse("schema", f"must be at most {SCHEMA}, but is {document['schema']}: use a newer fingervision.")
    steps = top.tables("step")
    if not steps:
        top.refuse(None, "must have at least one [[step]], but has none: add one with its kind.")
    below_force_n = top.number("below_force_n", BELOW_FORCE_N, above=0.0)
    return Recipe(top.word("name", path.stem), below_force_n, steps, text)


def write_recipe(
    path: Path, name: str, steps: Sequence[Mapping[str, object]], below_force_n: float = BELOW_FORCE_N
) -> None:
    """Write a recipe with the given steps."""
    lines = [f"schema = {SCHEMA}", f"name = {json.dumps(name, ensure_ascii=False)}", f"below_force_n = {below_force_n}"]
    for step in steps:
        lines += ["", "[[step]]"]
        lines += [f"{key} = {_in_toml(value)}" for key, value in step.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _in_toml(value: object) -> str:
    """Write a value of a step; a negative number that was rounded to zero becomes 0.0 instead of -0.0."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return f"{value + 0.0}" if isinstance(value, float) else f"{value}"
