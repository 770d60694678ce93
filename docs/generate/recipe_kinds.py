"""The reference of a recipe's steps: the kinds that the test bed knows, and their keys."""

from fingervision.domain.field import names_of, reference_table
from fingervision.testbed.recipe_kinds import step_kinds, words_of


def recipe_kinds_page() -> str:
    """Write a row for each kind of step, and a row for each key."""
    rows = []
    for name, kind in step_kinds().items():
        keys = ", ".join(f"`{key}`" for key in names_of(kind)) or "none"
        rows.append(f"| `{name}` | {keys} | {words_of(kind)} |")
    table = ["| `kind` | keys | what the test bed does |", "|---|---|---|", *rows]
    return "\n".join([*table, "", reference_table(*step_kinds().values())]) + "\n"
