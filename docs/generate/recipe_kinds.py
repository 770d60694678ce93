"""The reference of a recipe's steps: the kinds that the test bed knows, each with its keys."""

import importlib

from fingervision.testbed import recipe_kinds


def recipe_kinds_page() -> str:
    """Write a row for each kind of step."""
    rows = []
    for name in recipe_kinds.step_kinds():
        kind = importlib.import_module(f"{recipe_kinds.__name__}.{name}")
        first = (kind.__doc__ or "").strip().splitlines()[0].removeprefix("Recipe step: ")
        keys = ", ".join(f"`{key}`" for key in kind.KEYS) or "none"
        rows.append(f"| `{name}` | {keys} | {first[:1].upper()}{first[1:]} |")
    return "\n".join(["| `kind` | keys | what the test bed does |", "|---|---|---|", *rows]) + "\n"
