"""Text logs in which each number has its name before it: `t=0.100 x=0.61 gap=4.2`, as microcontrollers print."""

import re
from collections.abc import Sequence

from fingervision.tables.dialect import is_comment
from fingervision.tables.times import looks_like_time
from fingervision.tables.units import known_unit
from fingervision.tables.words import role_of

PAIR = re.compile(
    r"(?<!\d{4}-\d\d-\d\d)([^\W\d]\w*)\s*[=:]\s*([+-]?(?:\d+(?:\.\d*|,\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?)(?:\s*([^\W\d_]+)(?!\w*\s*[=:]))?"
)
"""A name, a number, and a unit, which is not the name of the next number. `T13:24` of a date and time is no pair."""
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
    # The serial monitor of the Arduino IDE writes the time of day before each line: `13:24:07.123 -> x=0.61`.
    stamped = "time" not in [role_of(name) for name, _ in names] and all(
        _stamp(line) for line in told if len(PAIR.findall(line)) == len(names)
    )
    out: list[str] = []
    rows = 0
    for line in lines:
        found = [] if is_comment(line) else PAIR.findall(line)
        same = [(name, unit if known_unit(unit) else "") for name, _, unit in found] == names
        rows += same
        values = [*([_stamp(line)] if stamped else []), *(value for _, value, _ in found)]
        out.append("\t".join(values) if same else f"# {line}" if line.strip() else "")
    if rows < FEWEST_LINES or len(told) - rows > max(1.0, MOST_OTHER * len(told)):
        return None
    if stamped:
        names = [("time", ""), *names]
    return ["\t".join(f"{name} [{unit}]" if unit else name for name, unit in names), *out]


def _stamp(line: str) -> str:
    """Date or time of day before the first pair of a line; empty if there is none."""
    first = PAIR.search(line)
    before = line[: first.start()].strip(" \t[](){}<>|;,-=") if first is not None else ""
    return before if before and looks_like_time([before]) else ""
