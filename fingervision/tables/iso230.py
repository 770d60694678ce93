"""Tables of targets, cycles and directions (ISO 230-2) from other programs, converted to fingervision's format."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.storage.iso230_table import (
    LARGEST_DEVIATION,
    SIDES,
    SMALLEST_TRAVEL,
    TARGET,
    Iso230Rows,
    iso230_rows,
)
from fingervision.storage.number_columns import Numbers
from fingervision.tables.cells import to_numbers
from fingervision.tables.column_names import ColumnName, column_name
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError, Question
from fingervision.tables.raw_table import RawTable
from fingervision.tables.times import looks_like_time, seconds_of
from fingervision.tables.units import factor
from fingervision.tables.words import FILLERS, tokens

KIND = "measured"
FROM_BELOW = (
    "auf aufwarts vorwarts vor hin positiv avant aller montee positif ida adelante positivo andata avanti salita"
)
FROM_ABOVE = (
    "ab abwarts ruckwarts zuruck negativ arriere retour descente negatif vuelta atras negativo ritorno indietro"
)
OTHER_SIDES = dict.fromkeys(FROM_BELOW.split(), "up") | dict.fromkeys(FROM_ABOVE.split(), "down")
"""Words for directions besides those of fingervision's own tables, without accents."""
CYCLES = frozenset(["cycle", "zyklus", "ciclo", "lauf", "run", "messreihe", "serie", "reihe", "i", "j"])
ARROWS = {"↑": " up ", "↓": " down ", "→": " up ", "←": " down "}


@dataclass(frozen=True, slots=True)
class _Block:
    """A column of a matrix table: its index, direction, cycle, and `position` or `deviation` if the name states it."""

    place: int
    side: str
    cycle: str
    quantity: str


def iso230_rows_of(raw: RawTable, given: Entry) -> Iso230Rows | None:
    """Interpret a raw table of targets, cycles and directions; None for any other table.

    Parameters
    ----------
    raw : RawTable
        Raw table from a file of any format.
    given : Entry
        Decisions of the user.

    Raises
    ------
    DataError
        For the same reasons as in `storage.iso230_table.read_iso230_table`.
    OpenQuestionError
        A unit is unknown, or it is unknown whether the readings are positions or deviations.
    """
    names = [column_name(column.name) for column in raw.columns]
    targets = _places(names, "target", given)
    if len(targets) != 1 or "input" in given.columns:
        return None
    directions = _places(names, "direction", given)
    blocks = [block for k, name in enumerate(names) if k != targets[0] and (block := _block(k, name)) is not None]
    if not directions and len(blocks) < 2:
        return None
    questions: list[Question] = []
    content: dict[str, list[str]] = {}
    target_mm = _length(raw, names, targets[0], "target", given, questions)
    content[TARGET] = _texts(target_mm)
    if directions and not blocks:
        readings = _long_form(raw, names, given)
        quantity = _quantity(raw, names, readings, target_mm, given, questions)
        content[f"{quantity}_mm"] = _texts(_length(raw, names, readings, quantity, given, questions))
        content["direction"] = [_side(word) for word in _words(raw, directions[0])]
        for role in ("cycle", "run"):
            if len(found := _places(names, role, given)) == 1:
                content[role] = _words(raw, found[0])
        times = _places(names, "time", given)
        if len(times) == 1:
            content["time_s"] = _texts(_time(raw, names, times[0], given, questions))
    else:
        quantity = next((block.quantity for block in blocks if block.quantity), "") or _quantity(
            raw, names, blocks[0].place, target_mm, given, questions
        )
        for block in blocks:
            values = _length(raw, names, block.place, quantity, given, questions)
            content[f"{block.side}_{block.cycle}_{quantity}_mm"] = _texts(values)
    if questions:
        unique = {question.key: question for question in questions}
        raise OpenQuestionError(raw.path, KIND, list(unique.values()))

    return iso230_rows(raw.path, content)


def _places(names: Sequence[ColumnName], role: str, given: Entry) -> list[int]:
    """Indices of the columns with a role: the column that the user names, otherwise those recognised by name."""
    stated = given.columns.get(role)
    if stated is not None:
        found = [k for k, name in enumerate(names) if stated in (name.text, name.base, str(k + 1))]
        if len(found) != 1:
            raise DataError(
                f"columns.{role} of {given.source} must name a column ({', '.join(n.text for n in names)}), but is "
                f"{stated}: correct it."
            )
        return found
    return [k for k, name in enumerate(names) if name.role == role]


def _side(word: str) -> str:
    """Translate a word for a direction to `up` or `down`; unknown words are kept, and refused later."""
    for arrow, side in ARROWS.items():
        word = word.replace(arrow, side)
    plain = " ".join(tokens(word)) or word.strip()
    return OTHER_SIDES.get(plain, word.strip())


def _block(place: int, name: ColumnName) -> _Block | None:
    """Interpret a name such as `1↑`, `up 2 [µm]`, `Abweichung vorwärts 3`, `+1` as a column of a matrix table."""
    text = name.base
    if (signed := re.fullmatch(r"\s*(?:(\d+)\s*([+-])|([+-])\s*(\d+))\s*", text)) is not None:
        sign, cycle = signed[2] or signed[3], signed[1] or signed[4]
        return _Block(place, "up" if sign == "+" else "down", cycle, "")
    for arrow, word in ARROWS.items():
        text = text.replace(arrow, word)
    text = re.sub(r"(?<=\D)(?=\d)|(?<=\d)(?=\D)", " ", text)
    words = tokens(text)
    sides = [OTHER_SIDES.get(word, word) for word in words if (word in SIDES and word.isalpha()) or word in OTHER_SIDES]
    cycles = [word for word in words if word.isdecimal()]
    rest = [word for word in words if not word.isdecimal() and word not in SIDES and word not in OTHER_SIDES]
    quantity = ""
    for word in rest:
        if word.startswith(("position", "posicion", "posizione", "istposition")):
            quantity = "position"
        elif word.startswith(("deviation", "abweichung", "desviacion", "scostamento", "ecart", "error", "fehler")):
            quantity = "deviation"
        elif word not in CYCLES and word not in FILLERS:
            return None
    return _Block(place, sides[0], cycles[0], quantity) if len(sides) == len(cycles) == 1 else None


def _long_form(raw: RawTable, names: Sequence[ColumnName], given: Entry) -> int:
    """Return the column of the readings in a table of the long form."""
    found = [k for role in ("position", "deviation") if role in given.columns for k in _places(names, role, given)] or [
        k for k, name in enumerate(names) if name.role in ("input", "gap", "deviation")
    ]
    if len(found) != 1:
        listed = " or ".join(f"'{raw.columns[k].name}'" for k in found) or "none of the columns, by its name"
        raise OpenQuestionError(
            raw.path,
            KIND,
            [
                Question(
                    f"the table has targets and directions, and the column of its readings may be {listed}",
                    f"columns.position={raw.columns[found[0]].name if found else 'NAME'}",
                )
            ],
        )
    return found[0]


def _quantity(
    raw: RawTable, names: Sequence[ColumnName], place: int, target_mm: Numbers, given: Entry, questions: list[Question]
) -> str:
    """Decide whether readings are positions or deviations: as the user states, by name, or by the range of values."""
    for role in ("position", "deviation"):
        if role in given.columns or role in given.units:
            return role
    if names[place].role == "deviation":
        return "deviation"
    if names[place].role in ("input", "gap"):
        return "position"
    values = _length(raw, names, place, "deviation", given, questions)
    both = values.present & target_mm.present
    if questions or not both.any() or np.ptp(target_mm.value[both]) == 0.0:
        return "deviation"
    share = float(np.ptp(values.value[both]) / np.ptp(target_mm.value[both]))
    if SMALLEST_TRAVEL <= share <= LARGEST_DEVIATION:
        questions.append(
            Question(
                f"'{raw.columns[place].name}' may hold positions or deviations from the target",
                "units.deviation=um",
            )
        )
    return "deviation" if share < SMALLEST_TRAVEL else "position"


def _length(
    raw: RawTable, names: Sequence[ColumnName], place: int, role: str, given: Entry, questions: list[Question]
) -> Numbers:
    """Return a column of lengths converted to mm; open questions about its unit are added to `questions`."""
    column = raw.columns[place]
    unit = given.units.get(role) or column.unit or names[place].unit
    size = factor(unit, "length") if unit else None
    if size is None:
        why = f"is '{unit}', which is not a length" if unit else "is not stated"
        questions.append(Question(f"the unit of '{column.name}' ({role}) {why}", f"units.{role}=mm"))
    values = _plain(raw, place)
    return Numbers(values.value * (size or 1.0), values.present)


def _plain(raw: RawTable, place: int) -> Numbers:
    content = raw.columns[place].content
    if isinstance(content, Numbers):
        return content
    values, odd = to_numbers(content, str(raw.settings.get("decimal", ".")))
    if odd.size:
        at = int(odd[0])
        raise DataError(
            f"'{raw.columns[place].name}' of {raw.path} must hold numbers, but holds '{content[at][:40]}' in "
            f"{raw.place(at)}: correct the cell, or leave it empty."
        )
    return values


def _time(raw: RawTable, names: Sequence[ColumnName], place: int, given: Entry, questions: list[Question]) -> Numbers:
    """Return the times (s) of a table of the long form."""
    content = raw.columns[place].content
    if not isinstance(content, Numbers) and looks_like_time(content):
        return seconds_of(content, given.words.get("date_order", "")).numbers
    unit = given.units.get("time") or raw.columns[place].unit or names[place].unit
    size = factor(unit, "time") if unit else None
    if size is None:
        questions.append(Question(f"the unit of '{raw.columns[place].name}' (time) is not stated", "units.time=s"))
    values = _plain(raw, place)
    return Numbers(values.value * (size or 1.0), values.present)


def _words(raw: RawTable, place: int) -> list[str]:
    content = raw.columns[place].content
    if isinstance(content, Numbers):
        return [f"{value:g}" if there else "" for value, there in zip(content.value, content.present, strict=True)]
    return [cell.strip() for cell in content]


def _texts(values: Numbers) -> list[str]:
    # Numbers are rounded to twelve digits (a picometre in a metre), which removes rounding errors of the unit
    # conversion.
    return [f"{value:.12g}" if there else "" for value, there in zip(values.value, values.present, strict=True)]
