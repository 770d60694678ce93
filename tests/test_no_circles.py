"""No module imports itself by way of others: each can be imported first."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

TOP = Path(__file__).parents[1]


def test_imports_form_no_circle() -> None:
    files = {".".join(path.relative_to(TOP).with_suffix("").parts): path for path in TOP.glob("fingervision/**/*.py")}
    graph: dict[str, set[str]] = {}
    for name, path in files.items():
        imports = [node for node in ast.parse(path.read_text("utf-8")).body if isinstance(node, ast.ImportFrom)]
        found = {node.module or "" for node in imports}
        found |= {f"{node.module}.{one.name}" for node in imports for one in node.names}
        graph[name] = (found & files.keys()) - {name}
    assert len(list(TopologicalSorter(graph).static_order())) >= len(files)
