"""A recipe: what the test bed is to run, step by step."""

from collections.abc import Mapping, Sequence
from pathlib import Path


def write_recipe(path: Path, name: str, steps: Sequence[Mapping[str, object]], below_force_n: float = 5.0) -> None:
    """Write a recipe of the given steps; keys and kinds are those of the design."""
    lines = ["schema = 1", f'name = "{name}"', f"below_force_n = {below_force_n}"]
    for step in steps:
        lines += ["", "[[step]]"]
        lines += [f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}" for key, value in step.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
