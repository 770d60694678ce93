"""An effect is named in its own file and in that of its law for a drawing; all other code asks for its attributes."""

import ast
from pathlib import Path

import fingervision
from fingervision.effects import catalogue

PACKAGE = Path(fingervision.__file__).parent
OWN_FOLDERS = ("effects", "models/laws")
STRAIGHT_LINE = PACKAGE / "diagnosis" / "inference" / "random_effect_search.py"
"""Names the two effects that make a straight line of the gap over the input."""


def test_no_code_outside_an_effect_s_own_file_names_it() -> None:
    own = tuple(PACKAGE / folder for folder in OWN_FOLDERS)
    others = [
        path for path in PACKAGE.rglob("*.py") if not any(map(path.is_relative_to, own)) and path != STRAIGHT_LINE
    ]
    named = {
        f"{path.relative_to(PACKAGE)}: {node.value}"
        for path in others
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in catalogue()
    }
    assert len(others) > 100
    assert not named
