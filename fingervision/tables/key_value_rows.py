"""Text logs in which each number has its name before it: `t=0.100 x=0.61 gap=4.2`, as microcontrollers print."""

import re
from collections.abc import Sequence

from fingervision.tables.dialect import is_comment
from fingervision.tables.units import known_unit

PAIR = re.compile(r"([^\W\d]\w*)\s*[=:]\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:\s*([^\W\d_]+)(?!\w*\s*[=:]))?")
"""A name, a number, and a unit, which is not the name of the next number."""
MOST_OTHER = 0.05
"""Largest share of lines without these names: a start-up message, and a line that was cut off."""
FEWEST_LINES = 3


def rows_of_pairs(lines: Sequence[str]) -> list[str] | None:
    """Write such a log as a table with tabs; None if the lines are no such log.

    A line that differs becomes a comment, so that the rows keep their line numbers.
    """
    told = [line for line in lines if line.strip() and not is_comment(line)]
    first = next((found for line in told[:FEWEST_LINES] if len(found := PAIR.findall(line)) > 1), None)
    if first is None or len(told) < FEWEST_LINES:
        return None
    names = [(name, unit if known_unit(unit) else "") for name, _, unit in first]
    out: list[str] = []
    rows = 0
    for line in lines:
        found = [] if is_comment(line) else PAIR.findall(line)
        same = [(name, unit if known_unit(unit) else "") for name, _, unit in found] == names
        rows += same
        out.append("\t".join(value for _, value, _ in found) if same else f"# {line}" if line.strip() else "")
    if rows < FEWEST_LINES or len(told) - rows > max(1.0, MOST_OTHER * len(told)):
        return None
    return ["\t".join(f"{name} [{unit}]" if unit else name for name, unit in names), *out]
