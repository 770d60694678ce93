"""Split a column's name into a name and a unit."""

import re
from dataclasses import dataclass
from functools import lru_cache
from html import unescape

from fingervision.tables.units import factor, known_unit, spelled
from fingervision.tables.words import role_of, source_of

BRACKETS = re.compile(r"^(?P<base>.*?)\s*(?:\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|<(?P<c>[^>]*)>|\{(?P<d>[^}]*)\})\s*$")
BESIDE = re.compile(r"^(?P<base>.+?)\s*(?P<mark>/|,|\bin\b|:|\s|_|-|\.)\s*(?P<unit>[^\s/,_:]+)\s*$")

LENGTHS = ("input", "gap", "left", "right", "u_gap", "u_random", "target", "position", "deviation")
DIMENSION = {**dict.fromkeys(LENGTHS, "length"), "time": "time", "force": "force"}
"""Dimension of the columns, by role."""


@dataclass(frozen=True, slots=True)
class ColumnName:
    """Parts of a column's name.

    Parameters
    ----------
    text : str
        The full name.
    base : str
        Name without the unit.
    unit : str
        Unit as written; empty if the name contains no unit.
    """

    text: str
    base: str
    unit: str

    @property
    def role(self) -> str | None:
        """Role that the name denotes; None if the name is not recognised."""
        return role_of(self.base)

    @property
    def source(self) -> str | None:
        """`measured` or `simulation` if the name states only the source of the values; None for any other name."""
        return source_of(self.base)


@lru_cache(maxsize=65_536)
def column_name(text: str) -> ColumnName:
    """Split a column's name into name and unit.

    Examples
    --------
    >>> column_name("Weg [µm]").unit, column_name("gap_mm").unit, column_name("Zeit/ms").unit, column_name("u_in").unit
    ('µm', 'mm', 'ms', '')
    >>> column_name("gap.mm").unit, column_name("stage.s").unit
    ('mm', '')
    >>> column_name("Force in N").base, column_name("gap"), column_name("opening, mm").unit
    ('Force', ColumnName(text='gap', base='gap', unit=''), 'mm')
    """
    text = unescape(text.strip().strip('"').strip())
    match = BRACKETS.match(text)
    if match is None and role_of(text) is not None and not _has_marked_unit(text):
        return ColumnName(text, text, "")
    if match is not None:
        unit = next(part for part in match.group("a", "b", "c", "d") if part is not None)
        # Brackets may contain a remark instead of a unit: `gap (left)`, `position (actual) [mm]`.
        if known_unit(unit) or _is_unit_of(match["base"], unit) or role_of(f"{match['base']} {unit}") is None:
            return ColumnName(text, re.sub(r"[\[\](){}]", " ", match["base"]).strip(), spelled(unit))
        return ColumnName(text, f"{match['base']} {unit}", "")
    if (match := BESIDE.match(text)) is not None and (known_unit(match["unit"]) or _has_marked_unit(text)):
        base = match["base"].strip(" _-/,.:")
        # `stage.s` is a variable `s` of `stage` (Modelica), and no position in seconds.
        dimension = DIMENSION.get(role_of(base) or "", "length")
        if match["mark"] == "." and factor(match["unit"], dimension) is None:
            return ColumnName(text, text, "")
        if role_of(base) is not None or source_of(base) is not None or base == "u":
            return ColumnName(text, base, spelled(match["unit"]))
    return ColumnName(text, text, "")


def _has_marked_unit(text: str) -> bool:
    """Whether a name ends with a slash or the word `in` and a unit of the dimension that the name before has."""
    match = BESIDE.match(text)
    return match is not None and match["mark"] in ("/", "in") and _is_unit_of(match["base"], match["unit"])


def _is_unit_of(base: str, unit: str) -> bool:
    """Whether a text is a unit of the dimension that a name has by its role."""
    dimension = DIMENSION.get(role_of(base.strip(" _-/,.:")) or "")
    return dimension is not None and factor(unit, dimension) is not None
