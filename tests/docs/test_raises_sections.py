"""What a docstring says of errors: its section Raises names the classes that the function's own lines raise."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from fingervision.domain import errors

ROOT = Path(__file__).parents[2]
BASE = "FingervisionError"
PARENTS = {
    name: [parent.__name__ for parent in value.__mro__]
    for name, value in vars(errors).items()
    if isinstance(value, type) and issubclass(value, errors.FingervisionError)
}


def _sections() -> Iterator[tuple[str, set[str], set[str]]]:
    """Give place, stated classes and directly raised classes of every function whose docstring has a section Raises."""
    for path in sorted((ROOT / "fingervision").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                stated = _stated(ast.get_docstring(node) or "")
                if stated:
                    yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", stated, _raised(node)


def _stated(docstring: str) -> set[str]:
    section = re.search(r"^Raises\n-+\n(.*?)(?=^\w+\n-{3,}|\Z)", docstring, re.MULTILINE | re.DOTALL)
    lines = section[1].splitlines() if section else []
    return {name.strip() for line in lines if line and not line.startswith(" ") for name in line.split(",")}


def _raised(function: ast.FunctionDef) -> set[str]:
    found = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name):
            found.add(node.exc.func.id)
    return found & set(PARENTS)


def test_every_error_that_a_function_raises_itself_is_in_its_docstring() -> None:
    missing = [
        f"{place} raises {raised}"
        for place, stated, own in _sections()
        for raised in sorted(own - {BASE})
        if not stated & (set(PARENTS[raised]) - {BASE})
    ]
    assert not missing, missing
