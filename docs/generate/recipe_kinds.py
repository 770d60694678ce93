"""The reference of a recipe's steps: the kinds that the bed knows, with the keys that each of them reads."""

import importlib

from fingervision.testbed import recipe_kinds


def recipe_kinds_page() -> str:
    """Write a row for each kind of step."""
    rows = []
    for name in recipe_kinds.step_kinds():
        kind = importlib.import_module(f"{recipe_kinds.__name__}.{name}")
        first = (kind.__doc__ or "").strip().splitlines()[0]
        rows.append(f"| `{name}` | {', '.join(f'`{key}`' for key in kind.KEYS) or 'none'} | {first} |")
    return "\n".join(["| `kind` | keys | what the bed does |", "|---|---|---|", *rows]) + "\n"
