"""Assign roles to the columns of a table: as stated by the user, otherwise by the columns' names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.column_suggestions import (
    SAME_MOTION,
    SURE,
    increases,
    range_of,
    ranked,
    rows_behind,
    values_of,
)
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import Question, Reading, asked
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.times import looks_like_time
from fingervision.tables.units import DIMENSION, LENGTHS, ColumnName, column_name, factor, spelled
from fingervision.tables.words import tokens

NEEDED = {"measured": ("input", "gap"), "drive": ("time", "input"), "simulation": ("input", "gap")}
"""Roles that a table of each kind must have; left and right together can replace the gap."""
WANTED = {
    "measured": ("time", "run", "left", "right", "force", "u_gap", "u_random"),
    "drive": ("run", "force"),
    "simulation": ("left", "right", "force"),
}
AXES = frozenset(["x", "y", "z", "a", "b", "c", "u", "v", "w", "1", "2", "3", "4", "5", "6"])
"""Words that tell one axis of a stage from another."""
MOST_READINGS = 6
UNIT = {"length": "mm", "time": "s", "force": "n"}
CANONICAL = {role: f"{role}_{UNIT[dimension]}" for role, dimension in DIMENSION.items()}
"""Names of the columns in fingervision's own tables, by role."""


@dataclass(slots=True)
class Findings:
    """Collects questions, notes and omissions while a table is interpreted."""

    questions: list[Question] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


def choose(raw: RawTable, names: Sequence[ColumnName], kind: str, given: Entry, about: Findings) -> dict[str, int]:
    """Return the column for each role (time, input, gap, ...); open questions are added to `about`.

    Parameters
    ----------
    raw : RawTable
        The table.
    names : sequence of ColumnName
        Names of the columns, split into name and unit.
    kind : str
        Kind of table as which the file is to be read.
    given : Entry
        Decisions of the user.
    about : object
        Object that collects questions and notes.
    """
    chosen = {role: _named_column(raw, role, name, given) for role, name in given.columns.items()}
    decimal = given.words.get("decimal") or str(raw.settings.get("decimal", "."))
    fixed = set(chosen.values())
    sources = [k for k, name in enumerate(names) if name.source == kind and k not in fixed]
    roles = _possible_roles(raw, names, kind, chosen, sources, decimal, about)
    sides = all(side in chosen or len(roles.get(side, ())) == 1 for side in ("left", "right"))
    suggested: set[int] = set()

    def readings(role: str, candidates: Sequence[int]) -> list[Reading]:
        """The possible columns of a role; no two questions suggest the same one, so that all can be followed."""
        found = sorted(ranked(raw, names, role, candidates, decimal), key=lambda k: k in suggested)
        suggested.update(found[:1])
        listed = [column.name for column in raw.columns]
        return [
            Reading(
                f"columns.{role}={listed[k] if listed.count(listed[k]) == 1 and listed[k] else k + 1}",
                range_of(raw.columns[k], names[k], decimal),
            )
            for k in found[:MOST_READINGS]
        ]

    for role in (*NEEDED[kind], *WANTED[kind]):
        if role in chosen:
            continue
        candidates = roles.get(role, [])
        exact = [k for k in candidates if names[k].text == CANONICAL.get(role, role)]
        if len(exact) == 1:
            candidates = exact
        if role == "time":
            candidates = _one_clock(raw, names, candidates, roles.get("date", []), about)
            if not candidates and kind != "simulation" and not roles.get("run"):
                candidates = _clock_by_unit(raw, names, set(chosen.values()), decimal, about)
        if len(candidates) == 1:
            chosen[role] = candidates[0]
        elif len(candidates) > 1:
            if role == "gap" and sides and not sources:
                continue
            listed = " or ".join(f"'{raw.columns[k].name}'" for k in candidates)
            about.questions.append(asked(f"the column of the {role} may be {listed}", readings(role, candidates)))
        elif role in NEEDED[kind] and not (role == "gap" and sides):
            free = [k for k in range(len(raw.columns)) if k not in set(chosen.values())]
            listed = ", ".join(f"'{raw.columns[k].name}'" for k in free[:12]) + (" ..." if len(free) > 12 else "")
            words = f"no column has a usual name for the {role} (the columns are {listed or 'taken'})"
            key = f"columns.{role}=NAME"  # without readings, no column of this table can answer
            found = readings(role, [k for k in free if _can_be(role, names[k])])
            about.questions.append(Question(words, found[0].key if found else key, CANONICAL[role], tuple(found)))
    return chosen


def _can_be(role: str, name: ColumnName) -> bool:
    """Whether a column without a usual name can have a role: no uncertainty, and no other dimension than a length."""
    is_length = role not in LENGTHS or not name.unit or factor(name.unit, "length") is not None
    return is_length and not name.text.startswith("u_")


def _possible_roles(
    raw: RawTable,
    names: Sequence[ColumnName],
    kind: str,
    chosen: Mapping[str, int],
    sources: list[int],
    decimal: str,
    about: Findings,
) -> dict[str, list[int]]:
    """Columns that may have each role by their names and, for the input, by their numbers."""
    fixed = set(chosen.values())
    roles: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        if place not in fixed and name.role is not None:
            # A target without a direction is a commanded position.
            roles.setdefault("input" if name.role == "target" else name.role, []).append(place)
    if "gap" not in roles and sources:
        roles["gap"] = sources
    if kind == "simulation" and not {"input", "time", "u_gap"} & {*roles, *chosen}:
        _lone_u(raw, names, roles, fixed, about)
    if "gap" not in chosen and "time" in roles and kind == "simulation":
        roles.pop("time")
    if "input" in roles:
        free = [k for k in range(len(names)) if k not in fixed and names[k].role in (None, "input", "target")]
        roles["input"] = _one_axis(raw, names, roles["input"], free, decimal, about)
        roles["input"] = _with_followers(raw, names, roles["input"], free, decimal, about)
    return roles


def _axis_and_stem(name: ColumnName) -> tuple[frozenset[str], tuple[str, ...]]:
    """The words for an axis in a name, and all other words."""
    words = tokens(name.base)
    return frozenset(words) & AXES, tuple(word for word in words if word not in AXES)


def _one_axis(
    raw: RawTable, names: Sequence[ColumnName], inputs: list[int], free: Sequence[int], decimal: str, about: Findings
) -> list[int]:
    """Of the axes of a stage, named alike but for a letter, take the one that moves; all if more than one moves."""
    axis, stem = _axis_and_stem(names[inputs[0]])
    axes = [k for k in free if _axis_and_stem(names[k])[1] == stem and len(_axis_and_stem(names[k])[0]) == len(axis)]
    same_unit = {spelled(raw.columns[k].unit) or names[k].unit for k in axes}
    different = len({_axis_and_stem(names[k])[0] for k in axes}) == len(axes)
    if len(axis) != 1 or len(axes) < 2 or not set(inputs) <= set(axes) or len(same_unit) > 1 or not different:
        return inputs
    moved = {k: float(np.ptp(found)) if (found := values_of(raw.columns[k], decimal)).size else 0.0 for k in axes}
    most, *others = sorted(axes, key=lambda k: -moved[k])
    if moved[most] <= SURE * moved[others[0]]:
        return sorted([most, *(k for k in others if moved[k] > 0.0)])
    if others:
        about.notes.append(
            f"'{raw.columns[most].name}' is read as the input: it moves {moved[most]:.4g}, and "
            f"'{raw.columns[others[0]].name}' {moved[others[0]]:.4g}, in the unit of the file."
        )
    return [most]


def _with_followers(
    raw: RawTable, names: Sequence[ColumnName], inputs: list[int], free: Sequence[int], decimal: str, about: Findings
) -> list[int]:
    """Add to a set-point the columns of lengths that make the same motion: one may be the position reached."""
    if not all(names[k].role == "target" for k in inputs):
        return inputs
    lead = values_of(raw.columns[inputs[0]], decimal)

    def follows(k: int) -> bool:
        values = values_of(raw.columns[k], decimal)
        unit = spelled(raw.columns[k].unit) or names[k].unit
        if not unit or factor(unit, "length") is None or values.size != lead.size or not lead.size:
            return False
        return bool(np.std(values - lead) < SAME_MOTION * np.ptp(lead) or rows_behind(values, lead) != 0)

    found = inputs + [k for k in free if k not in inputs and follows(k)]
    if len(found) == 1:
        about.notes.append(f"'{raw.columns[found[0]].name}' is a set-point: the position that was reached may differ.")
    return found


def _lone_u(
    raw: RawTable, names: Sequence[ColumnName], roles: dict[str, list[int]], fixed: set[int], about: Findings
) -> None:
    """Take a simulation's column `u` with a unit of length as the input: `u` often denotes a displacement.

    This is done only if no other column is an input, and if neither a time nor an uncertainty indicates a measurement,
    in which `u` would be a standard uncertainty.
    """
    found = [
        place
        for place, name in enumerate(names)
        if place not in fixed
        and name.base == "u"
        and factor(spelled(raw.columns[place].unit) or name.unit or "-", "length") is not None
    ]
    if len(found) == 1:
        roles["input"] = found
        about.notes.append(
            f"'{raw.columns[found[0]].name}' is read as the input (a prescribed displacement); to name another "
            f"column, set columns.input in columns.toml."
        )


def _one_clock(
    raw: RawTable, names: Sequence[ColumnName], times: list[int], dates: list[int], about: Findings
) -> list[int]:
    """Choose the time column: the elapsed time if there is also a date; otherwise the date."""
    both = times + [k for k in dates if _is_dated(raw.columns[k])]
    elapsed = [k for k in times if not _is_dated(raw.columns[k])]
    if len(both) > 1 and len(elapsed) == 1:
        others = ", ".join(raw.columns[k].name for k in both if k != elapsed[0])
        about.notes.append(f"{raw.columns[elapsed[0]].name} is read as the time, not {others}.")
        return elapsed
    if len(times) == 1 and not elapsed and len(both) > 1:
        return times  # date and time of day in separate columns are joined later
    if len(times) > 1 and _alike([raw.columns[k] for k in times]):
        return times[:1]  # a clock beside each channel
    return times or both


def _clock_by_unit(
    raw: RawTable, names: Sequence[ColumnName], taken: set[int], decimal: str, about: Findings
) -> list[int]:
    """Take the only column with a unit of time, or with dates, whose name does not denote the time."""
    found = [
        k
        for k, (column, name) in enumerate(zip(raw.columns, names, strict=True))
        if k not in taken and name.role is None and (unit := spelled(column.unit) or name.unit)
        and factor(unit, "time") is not None and increases(column, decimal)
    ]  # fmt: skip
    if len(found) == 1:
        about.notes.append(
            f"'{raw.columns[found[0]].name}' is taken for the time: it has a unit of time, and increases."
        )
        return found
    dated = [
        k
        for k, (column, name) in enumerate(zip(raw.columns, names, strict=True))
        if k not in taken and name.role is None and _is_dated(column) and _varies(column)
    ]
    if len(dated) == 1 and not found:
        about.notes.append(
            f"Column {dated[0] + 1}, '{raw.columns[dated[0]].name}', is taken for the time: it holds times."
        )
        return dated
    return []


def _varies(column: RawColumn) -> bool:
    """Whether a column holds more than one time (a column of dates often holds a single one)."""
    return isinstance(column.content, Numbers) or len(set(column.content)) > 1


def _alike(columns: Sequence[RawColumn]) -> bool:
    """Whether all columns hold the same cells or numbers."""
    first = columns[0].content
    if isinstance(first, Numbers):
        return all(
            isinstance(one.content, Numbers) and np.array_equal(one.content.value, first.value) for one in columns
        )
    return all(not isinstance(one.content, Numbers) and list(one.content) == list(first) for one in columns)


def _is_dated(column: RawColumn) -> bool:
    return bool(column.since) if isinstance(column.content, Numbers) else looks_like_time(column.content)


def _named_column(raw: RawTable, role: str, name: str, given: Entry) -> int:
    """Find the column that the user names by its full name, its name without the unit, or its number."""
    for way in (lambda c: c.name.strip(), lambda c: column_name(c.name).base, lambda c: c.name.strip().lower()):
        found = [k for k, column in enumerate(raw.columns) if way(column) == name or way(column) == name.lower()]
        if len(found) == 1:
            return found[0]
    if name.isdecimal() and 1 <= int(name) <= len(raw.columns):
        return int(name) - 1
    raise DataError(
        f"columns.{role} of {given.source} must name a column of {raw.path} "
        f"({', '.join(column.name for column in raw.columns)}), but is {name}: correct it."
    )
