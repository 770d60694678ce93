"""Draw sentences at random for a reader with fresh eyes: `python tests/benchmarks/drawn_sentences.py --seed 1`.

Thirty from docstrings, thirty from messages, thirty from the manual; a reader who knows statistics, optics or mechanics
and not this project marks those that are not understood at first reading. `--all` prints every first sentence of a
docstring of the packages named, for a reading from end to end.
"""

import argparse
import ast
import random
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
COUNT = 30
SHORTEST = 5
"""Words: what has fewer is a heading or a label."""


def docstrings(packages: tuple[str, ...] = ("fingervision", "calib")) -> Iterator[tuple[str, str]]:
    """Give every docstring with its place."""
    for package in packages:
        for path in sorted((ROOT / package).rglob("*.py") if (ROOT / package).is_dir() else [ROOT / package]):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
                    name = getattr(node, "name", "")
                    yield f"{path.relative_to(ROOT)}:{name}", ast.get_docstring(node) or ""


def messages() -> Iterator[tuple[str, str]]:
    """Give the text of every exception that is raised, with braces where values stand."""
    for path in sorted((ROOT / "fingervision").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
                text = _text(node.exc.args[0])
                if text:
                    yield f"{path.relative_to(ROOT)}:{node.lineno}", text


def pages() -> Iterator[tuple[str, str]]:
    """Give the prose of the manual's pages."""
    for path in sorted((ROOT / "docs").rglob("*.md")):
        text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        lines = [line for line in text.splitlines() if not re.match(r"\s*(\||#|:|<!--|\$\$)", line)]
        yield str(path.relative_to(ROOT)), "\n".join(lines)


def sentences(texts: Iterator[tuple[str, str]]) -> list[tuple[str, str]]:
    """Cut texts into sentences; sections of parameters, examples and code are left out."""
    found = []
    for place, text in texts:
        prose = re.split(r"\n(?:Parameters|Attributes|Returns|Raises|Yields|Examples)\n-{3,}", text)[0]
        for paragraph in re.split(r"\n\s*\n", prose):
            if ">>>" in paragraph or "::" in paragraph or paragraph.lstrip().startswith("|"):
                continue
            cut = re.split(r"(?<=[.!?])\s+(?=[A-Z`*])", " ".join(paragraph.split()))
            found += [(place, sentence) for sentence in cut if len(sentence.split()) >= SHORTEST]
    return found


def _text(node: ast.expr) -> str:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(v.value) if isinstance(v, ast.Constant) else "{...}" for v in node.values)
    return ""


def main() -> None:
    """Print the sentences."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--all", nargs="*", metavar="PACKAGE")
    asked = parser.parse_args()
    if asked.all is not None:
        for place, sentence in sentences(docstrings(tuple(asked.all) or ("fingervision", "calib"))):
            print(f"{place}  {sentence}")
        return
    for title, texts in (("docstrings", docstrings()), ("messages", messages()), ("manual", pages())):
        print(f"\n## {title}")
        for place, sentence in random.Random(asked.seed).sample(sentences(texts), COUNT):
            print(f"[{place}] {sentence}")


if __name__ == "__main__":
    main()
