"""User-named channels in tables of other programs: poses of bodies, such as `link 2.x [µm]`, with `u_` columns."""

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from fingervision.storage.csv_columns import Numbers
from fingervision.storage.measured_table import NO_CHANNELS
from fingervision.tables.dialect import to_numbers
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.units import BESIDE, BRACKETS, column_name, factor, known_unit, spelled

MRAD = {
    **dict.fromkeys(("mrad", "milliradian", "milliradians"), 1.0),
    **dict.fromkeys(("rad", "radian", "radians"), 1e3),
    **dict.fromkeys(("urad", "µrad", "microradian", "microradians"), 1e-3),
    **dict.fromkeys(("deg", "°", "degree", "degrees", "degré", "degrés"), 1e3 * float(np.pi) / 180.0),
    **dict.fromkeys(("mdeg", "millidegree", "millidegrees"), float(np.pi) / 180.0),
    **dict.fromkeys(("arcsec", "″"), 1e3 * float(np.pi) / 648_000.0),
}
"""Units of angle as written in tables, in mrad. `grad` is omitted, because it denotes degrees in German and gons in
surveying."""
BARE = frozenset({"mm", "um", "nm", "mrad", "urad", "µrad", "rad", "deg", "mdeg"})
"""Units that are recognised at the end of a name without brackets; `in`, `m` and similar units would be ambiguous
there."""


@dataclass(frozen=True, slots=True)
class BodyChannels:
    """Channels of a table in addition to its gap.

    Parameters
    ----------
    columns : dict of str to Numbers
        Channels in mm and mrad, named `name_mm` and `name_mrad`; standard uncertainties have the prefix `u_`.
    names : dict of str to str
        Name of each channel's column in the file.
    notes : list of str
        Columns that could not be used as channels, with the reasons.
    """

    columns: dict[str, Numbers] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def channels_in(raw: RawTable, used: Collection[int], decimal: str) -> BodyChannels:
    """Collect as channels all columns that have a unit of length or angle but no role.

    Parameters
    ----------
    raw : RawTable
        The table.
    used : collection of int
        Indices of the columns that have a role.
    decimal : str
        Decimal mark of the table.
    """
    found = BodyChannels()
    places: dict[str, list[int]] = {}
    sizes: dict[int, float] = {}
    for place, column in enumerate(raw.columns):
        if place not in used and (taken := _channel(column)) is not None:
            sizes[place] = taken[1]
            places.setdefault(taken[0], []).append(place)
    for name, of_name in places.items():
        if name.startswith("u_") and name.removeprefix("u_") not in places:
            continue
        column = raw.columns[of_name[0]]
        if len(of_name) > 1:
            listed = " and ".join(f"'{raw.columns[k].name}'" for k in of_name)
            found.notes.append(f"the channel {name} was left out, because several columns fit its name: {listed}.")
            continue
        values, unread = _numbers(column, decimal)
        if unread:
            found.notes.append(f"the column {column.name} was left out: {unread} of its cells are not numbers.")
            continue
        size = sizes[of_name[0]]
        found.columns[name] = values if size == 1.0 else Numbers(values.value * size, values.present)
        found.names[name] = column.name
    return found


def _numbers(column: RawColumn, decimal: str) -> tuple[Numbers, int]:
    if isinstance(column.content, Numbers):
        return column.content, 0
    values, odd = to_numbers(column.content, decimal)
    return values, int(odd.size)


def _channel(column: RawColumn) -> tuple[str, float] | None:
    """Name of the channel in a column, and the conversion factor of its unit; None for a column of another kind."""
    text = column.name.strip().strip('"').strip()
    if text in NO_CHANNELS or column.since:
        return None
    base, unit = _apart(text)
    stated = spelled(column.unit) or unit
    own = spelled(column.unit) and unit
    if not base or not stated or (own and _size(own) != _size(stated)):
        return None
    size = _size(stated)
    bare = base[2:] if base.startswith("u_") else base
    if size is None or column_name(bare).role is not None:
        return None
    plain = "_".join(bare.split())
    return f"{'u_' if bare != base else ''}{plain}_{size[0]}", size[1]


def _apart(text: str) -> tuple[str, str]:
    """Split a text into a name and its unit."""
    if (match := BRACKETS.match(text)) is not None:
        unit = next(part for part in match.group("a", "b", "c", "d") if part is not None)
        return match["base"].strip(), spelled(unit)
    if (match := BESIDE.match(text)) is not None and (known_unit(match["unit"]) or match["unit"].lower()) in BARE:
        return match["base"].strip(" _-/,.:"), spelled(match["unit"])
    return text, ""


def _size(unit: str) -> tuple[str, float] | None:
    """Target unit (`mm` or `mrad`) for a unit, and the conversion factor."""
    if (angle := MRAD.get(unit.lower())) is not None and unit != "Mrad":
        return "mrad", angle
    length = factor(unit, "length") if known_unit(unit) else None
    return None if length is None else ("mm", length)
