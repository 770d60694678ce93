"""No module imports itself by way of others, not even later, inside a function: each can be imported first."""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

TOP = Path(__file__).parents[1]


def imports_of(node: ast.AST) -> Iterator[ast.ImportFrom]:
    """Imports of a module and of its functions, without those for types alone."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.ImportFrom):
            yield child
        elif isinstance(child, ast.stmt | ast.ExceptHandler) and not is_for_types(child):
            yield from imports_of(child)


def is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def test_imports_form_no_circle() -> None:
    paths = [path for package in ("fingervision", "calib") for path in (TOP / package).rglob("*.py")]
    files = {".".join(path.relative_to(TOP).with_suffix("").parts): path for path in paths}
    graph: dict[str, set[str]] = {}
    for name, path in files.items():
        imports = list(imports_of(ast.parse(path.read_text("utf-8"))))
        found = {node.module or "" for node in imports}
        found |= {f"{node.module}.{one.name}" for node in imports for one in node.names}
        graph[name] = (found & files.keys()) - {name}
    assert len(list(TopologicalSorter(graph).static_order())) >= len(files)
