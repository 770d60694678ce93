"""The file recipe.toml: the steps that the test bed executes."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from fingervision.domain.recipe import Recipe
from fingervision.storage.toml_section import Section, read_section
from fingervision.storage.toml_text import toml_lines

SCHEMA = 1
BELOW_FORCE_N = 5.0


def read_recipe(path: Path) -> Recipe[Section]:
    """Read a recipe; the settings of each step are read by the step's kind.

    Raises
    ------
    DataError, InputFileError
        The file does not exist, is not TOML, has a newer schema, has no step, or has an unknown key.
    """
    top = read_section(path, "recipe", ("name", "below_force_n", "step"), SCHEMA)
    steps = top.tables("step")
    if not steps:
        top.refuse(None, "must have at least one [[step]], but has none: add one with its kind.")
    below_force_n = top.number("below_force_n", BELOW_FORCE_N, above=0.0)
    return Recipe(top.word("name", path.stem), below_force_n, steps, top.text)


def write_recipe(
    path: Path, name: str, steps: Sequence[Mapping[str, object]], below_force_n: float = BELOW_FORCE_N
) -> None:
    """Write a recipe with the given steps."""
    lines = toml_lines({"schema": SCHEMA, "name": name, "below_force_n": below_force_n})
    for step in steps:
        lines += toml_lines(step, "[[step]]")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
