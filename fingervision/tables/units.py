"""Units as written in tables, with their factors to mm, s and N; column names split into a name and a unit."""

import re
from dataclasses import dataclass
from functools import cache, lru_cache
from html import unescape
from typing import TYPE_CHECKING, Any

from fingervision.domain.errors import InstallationError
from fingervision.tables.words import role_of, source_of

if TYPE_CHECKING:
    from pint import UnitRegistry

CANONICAL = {"length": "mm", "time": "s", "force": "N"}
WRITTEN = {
    "s": "s sec secs second seconds sek sekunde sekunden seconde secondes segundo segundos secondo secondi "
    "\u0441 сек 秒 초",
    "ms": "ms msec millisecond milliseconds millisekunde millisekunden milliseconde millisecondes milisegundos "
    "millisecondi мс 毫秒 ミリ秒",
    "us": "us usec µs microsecond microseconds mikrosekunden",
    "ns": "ns",
    "ps": "ps",
    "min": "min minute minutes minuten minutos minuti",
    "h": "h hr hrs hour hours stunde stunden std heures horas ore",
    "day": "d day days tage",
    "m": "m meter metre meters metres mètre mètres metro metros metri м",
    "cm": "cm",
    "mm": "mm millimeter millimetre millimeters millimetres millimètre millimètres milímetro milímetros millimetri "
    "мм 毫米 公釐 ミリメートル",
    "um": "um µm micron microns mikron micrometer micrometre micrometers micrometres mikrometer micromètre micromètres "
    "micrómetros micrometri мкм 微米",
    "nm": "nm nanometer nanometre nanometers нм 纳米",
    "pm": "pm picometer picometre picometers",
    "inch": 'in inch inches zoll "',
    "thou": "mil mils thou",
    "N": "n newton newtons н",
    "mN": "mn millinewton",
    "uN": "un µn",
    "kN": "kn",
    "gram_force": "gf",
    "kgf": "kgf",
    "lbf": "lbf",
}
"""Units, each with the words and symbols that denote it, in lower case."""
BY_WORD = {word: unit for unit, words in WRITTEN.items() for word in words.split()}
BY_PREFIX = re.compile(r"(?:[fdck]|da)?m|(?:[kc]|da)?N|[fpn]s|Å|angstroms?|ft|foot|feet|yd|dyne?|pond")
"""Other units, by the symbols of the units library. The library knows many more, and so reads a camera's `px` as 1/96
inch, `a` as a year, and the `?m` of a lost micro sign as a metre; these are no units of such tables."""
POWER = re.compile(
    r"(?:10\s*(?:\^|\*\*)\s*(?P<power>[+-]?\d{1,2})|[eE](?P<e>[+-]\d{1,2})|1\s*/\s*(?P<part>[1-9]\d*))\s*"
)
"""A power of ten or a fraction before a unit: `10^-3 mm`, `e-6 m`, `1/100 mm`."""
SINCE = re.compile(r"\s+since\b.*")
CASE_TELLS = {"Mm": None, "MN": None, "Nm": None}
"""Spellings whose meaning differs from that of their lower case; the user is asked about their meaning."""
NO_UNIT = frozenset({"", "-", "1", "[-]", "\u2013", "none", "n/a"})


@cache
def registry() -> "UnitRegistry[Any]":
    """Load the units library once, and only when a table of another program is read."""
    from pint import UnitRegistry

    return UnitRegistry(cache_folder=None)


def spelled(text: str) -> str:
    """Normalise the spelling of a unit: one micro sign, no brackets, and no origin of times (`s since 1904`)."""
    text = SINCE.sub("", text).strip().strip("[](){}<>").strip().rstrip(".")
    text = text.replace("\u03bc", "µ").replace("Âµ", "µ").replace("Î¼", "µ")
    # One character for a unit, as fonts of East Asia have it.
    return text.replace("\u339c", "mm").replace("\u339b", "µm").replace("\u339a", "nm").replace("\u33b3", "ms")


@cache
def known_unit(text: str) -> str | None:
    """Name of a unit of length, time or force from its word or symbol; None for an unknown unit."""
    text = spelled(text)
    if text in CASE_TELLS:
        return CASE_TELLS[text]
    return BY_WORD.get(text.lower())


@cache
def factor(text: str, dimension: str) -> float | None:
    """Conversion factor of a unit, or of a multiple such as `0.1 µm`, to mm, s or N; None if the dimension differs.

    Raises
    ------
    InstallationError
        The library pint is not installed.
    """
    try:
        units = registry()
    except ImportError as error:
        raise InstallationError(
            "Units of a foreign table need the library pint, which is not installed: pip install pint."
        ) from error
    size, rest = written_multiple(spelled(text))
    unit = known_unit(rest)
    if unit is None and (spelled(rest) in CASE_TELLS or BY_PREFIX.fullmatch(spelled(rest)) is None):
        return None
    try:
        quantity = units.Quantity(size, unit or spelled(rest))
        found = float(quantity.to(CANONICAL[dimension]).magnitude)
    except Exception:
        return None
    return found if found > 0.0 else None


def written_multiple(words: str) -> tuple[float, str]:
    """Split `0.1 um` or `10^-3 mm` into a number and a unit.

    Examples
    --------
    >>> written_multiple("0.1 um"), written_multiple("10^-3 mm"), written_multiple("1/100 mm"), written_multiple("mm")
    ((0.1, 'um'), (0.001, 'mm'), (0.01, 'mm'), (1.0, 'mm'))
    """
    if (scale := POWER.match(words)) is not None and scale.end() < len(words):
        rest = words[scale.end() :]
        return (1.0 / float(scale["part"]) if scale["part"] else 10.0 ** int(scale["power"] or scale["e"])), rest
    amount, _, rest = words.partition(" ")
    try:
        return float(amount), rest
    except ValueError:
        return 1.0, words


@cache
def is_unit(text: str) -> bool:
    """Whether a cell may be part of a row of units: it is a unit of any dimension, or empty."""
    words = spelled(text)
    if words.lower() in NO_UNIT or known_unit(words) is not None or words in {"%", "°", "°C", "C", "V", "A", "Hz"}:
        return True
    rest = re.sub(r"^[x\u00d7*\u00b7]\s*", "", words)
    if written_multiple(rest)[1] != rest:
        return any(factor(rest, dimension) is not None for dimension in CANONICAL)
    if len(words) > 12 or any(letter.isdigit() and letter not in "23" for letter in words):
        return False
    try:
        registry().parse_units(words.replace("µ", "u"))
    except Exception:
        return False
    return True


# Split a column's name into a name and a unit.

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
