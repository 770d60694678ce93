"""Truths of the foreign tables, read by the standard library alone."""

import csv
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Truth:
    """What a foreign table holds, or the key that it asks for."""

    table: Path
    kind: str
    asks: str
    refused: str
    states: tuple[str, ...]
    columns: dict[str, list[str]]


def truths() -> list[Truth]:
    """All of the collection, by name."""
    return [truth_in(path) for path in sorted(HERE.glob("*.truth.csv"))]


def truth_in(path: Path) -> Truth:
    """Read one."""
    lines = path.read_text(encoding="utf-8").splitlines()
    about = [line[2:].split(": ", 1) for line in lines if line.startswith("# ")]
    keys = dict(about)
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    columns = {name: [row[k] for row in rows[1:]] for k, name in enumerate(rows[0])} if rows else {}
    states = tuple(words for key, words in about if key == "set")
    return Truth(
        path.parent / keys["file"], keys["kind"], keys.get("asks", ""), keys.get("refused", ""), states, columns
    )
