"""The file columns.toml: the user's decisions about the meaning of tables from other programs."""

import fnmatch
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.storage.durable import written
from fingervision.storage.plain_file import in_utf8, toml_lines
from fingervision.storage.toml_section import Section, read_document, read_section

NAME = "columns.toml"
KINDS = ("measured", "drive", "simulation")
ROLES = (
    "time", "date", "input", "gap", "left", "right", "force", "run", "u_gap", "u_random", "target", "cycle",
    "direction", "position", "deviation",
)  # fmt: skip
WORDS = {
    "separator": (",", ";", "tab", "|", "blank"),
    "decimal": (".", ","),
    "runs": ("restart", "one"),
    "date_order": ("dmy", "mdy", "ymd"),
    "clock": ("continuous", "as_written"),
}
"""Keys whose value must be one of a few words."""
TEXTS = ("encoding", "part", "missing")
"""Keys whose value is any text: an encoding, a part of the file, the number that means no value."""
ACCEPTED = ("constant_input", "backward_time", "repeated_time", "sizes", "speed", "overlap", "unreadable_cells")
KEYS = ("file", "as", "columns", "units", *WORDS, *TEXTS, "header_line", "accept")


@dataclass(frozen=True, slots=True)
class Entry:
    """The user's decisions about one table.

    Parameters
    ----------
    columns : mapping of str to str
        Name (or number, from 1) of the column of each role.
    units : mapping of str to str
        Unit of the column of each role; may be a multiple such as `0.1 µm`.
    words : mapping of str to str
        Values of the other keys that are texts.
    header_line : int or None
        Number of the line with the column names; 0 if there is no such line.
    accept : frozenset of str
        Names of doubts whose values the user has confirmed.
    source : Path or None
        Path of the columns.toml; None if there is none.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)
    header_line: int | None = None
    accept: frozenset[str] = frozenset()
    source: Path | None = None

    @property
    def says_nothing(self) -> bool:
        """Whether the entry contains no decision of the user."""
        return self.source is None

    def over(self, other: "Entry") -> "Entry":
        """Combine two entries; the keys of this entry override those of `other`."""
        return Entry(
            {**other.columns, **self.columns},
            {**other.units, **self.units},
            {**other.words, **self.words},
            other.header_line if self.header_line is None else self.header_line,
            other.accept | self.accept,
            self.source or other.source,
        )


def entry_for(table: Path, kind: str | None, columns: Path | None = None) -> Entry:
    """Collect the decisions about a table from `--columns`, otherwise from a columns.toml in the table's folder.

    Parameters
    ----------
    table : Path
        The table.
    kind : str or None
        Kind of table as which the file is read; None if not known yet.
    columns : Path or None
        The columns.toml that the user names; None if none is named.

    Raises
    ------
    DataError, InputFileError
        The named file does not exist, or a key in it is wrong.
    """
    path = columns if columns is not None else table.parent / NAME
    if columns is None and not path.is_file():
        return Entry()
    top = read_section(path, "mapping of columns", ("table",), 1, stated=1)
    found = Entry()
    for section in top.tables("table"):
        section.only(KEYS)
        for_kind = section.word("as", "", of=("", *KINDS))
        pattern = section.word("file", "*")
        if for_kind and kind is not None and for_kind != kind:
            continue
        if _matches(table, pattern, path.parent):
            found = _entry(section, path).over(found)
    return found


def _matches(table: Path, pattern: str, folder: Path) -> bool:
    """Whether a pattern matches the name of a table, or its path relative to the folder of columns.toml."""
    relative = Path(os.path.relpath(table.resolve(), folder.resolve())).as_posix()
    return any(name == pattern or fnmatch.fnmatchcase(name, pattern) for name in (table.name, relative))


def _entry(section: Section, path: Path) -> Entry:
    columns, units = (section.table(key) for key in ("columns", "units"))
    for each in (columns, units):
        each.only(ROLES)
    accept = section.values.get("accept", [])
    if not isinstance(accept, list) or not all(word in ACCEPTED for word in accept):
        section.refuse("accept", f"must be a list of some of {', '.join(ACCEPTED)}, but is {accept!r}.")
    return Entry(
        {role: str(value) for role, value in columns.values.items()},
        {role: str(value) for role, value in units.values.items()},
        {
            **{key: section.word(key, of=words) for key, words in WORDS.items() if key in section.values},
            **{key: section.word(key) for key in TEXTS if key in section.values},
        },
        section.whole("header_line", low=0) if "header_line" in section.values else None,
        frozenset(accept),
        path,
    )


def entry_of_settings(settings: Sequence[str], source: Path) -> Entry:
    """Read the values of `--set` options, such as `columns.gap=comsol_mm`.

    Raises
    ------
    DataError
        A setting has an unknown key, or no value.
    """
    document: dict[str, Any] = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        first, _, second = key.strip().partition(".")
        if not equals or not value.strip():
            raise DataError(f"--set must be KEY=VALUE, such as columns.gap=comsol_mm, but is {setting}.")
        if second:
            document.setdefault(first, {})[second] = value.strip()
        elif first == "accept":
            document[first] = [*document.get(first, []), *value.replace(",", " ").split()]
        elif first == "header_line" and value.strip().isdecimal():
            document[first] = int(value)
        else:
            document[first] = value.strip()
    section = Section(source, "", "table", document)
    section.only(tuple(key for key in KEYS if key not in ("file", "as")))
    return _entry(section, source)


def entry_text(table: str, kind: str | None, entry: Entry) -> str:
    """Format an entry as a table of columns.toml."""
    keys = {
        "file": table,
        "as": kind,
        **entry.words,
        "header_line": entry.header_line,
        "accept": sorted(entry.accept) or None,
        **{f"columns.{role}": name for role, name in entry.columns.items()},
        **{f"units.{role}": unit for role, unit in entry.units.items()},
    }
    return "\n".join(["[[table]]", *toml_lines(keys)]) + "\n"


def write_entry(path: Path, table: str, kind: str | None, entry: Entry) -> bool:
    """Write an entry to columns.toml; entries of other tables and the comments above them stay unchanged.

    Returns
    -------
    bool
        Whether the file has changed.

    Raises
    ------
    DataError, InputFileError, OutputError
        The file cannot be read or written.
    """
    block = in_utf8(path, entry_text(table, kind, entry))
    before = read_document(path, NAME)[1] if path.exists() else "schema = 1\n"
    parts = [part.strip("\n") for part in re.split(r"(?m)^(?=\s*\[\[\s*table\s*\]\])", before)]
    ours = block.splitlines()[: 2 if kind is None else 3]
    kept = [part for part in parts if part and not _is_of(part, ours)]
    if block.strip("\n") in parts:
        return False
    with written(path, "name another file with --out, and give it to --columns") as new:
        new.write_text("\n\n".join([*kept, block]), encoding="utf-8")
    return True


def _is_of(part: str, ours: Sequence[str]) -> bool:
    """Whether a part of columns.toml is the entry for the same file and the same kind of table."""
    lines = [re.sub(r"\s*=\s*", " = ", line.strip()) for line in part.splitlines()]
    kinds = [line for line in lines if line.startswith("as = ")]
    return all(line in lines for line in ours) and (len(ours) == 3 or not kinds)
