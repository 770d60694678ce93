"""The words of an instrument that talks in lines of text, from a TOML file: what is said, and what is answered.

The format is explained in the manual (docs/how_to/stages.md); the files of the package are in `files/`.
"""

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from string import Formatter
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.storage.toml_section import Section, read_section

FILES = Path(__file__).parent / "files"
SCHEMA = 1
TOP = ("name", "baud", "serial", "line_end", "answer_end", "open_s", "answer_s", "refusal")
SAID = ("say", "line_end", "reply", "done", "answer_s")
ACTIONS: Mapping[str, tuple[str, ...]] = {
    "position": (*SAID, "per_mm"),
    "busy": (*SAID, "moving", "moving_bits"),
    "move": (*SAID, "per_mm", "speed_per_mm_s"),
    "home": (*SAID, "blocks", "stop"),
    "stop": ("say", "line_end"),
    "check": SAID,
    "close": ("say", "line_end"),
    "value": (*SAID, "scale"),
}
"""Tables of a file of words, with their keys; `[[open]]` may be repeated, and `[settings]` has keys of its own."""
SCALES = ("per_mm", "speed_per_mm_s")
NAME = re.compile(r"\{(\w+)\}")
ANSWER_S = 1.0


@dataclass(frozen=True, slots=True)
class Exchange:
    """What is said, each line in turn, and the reply that is awaited after each.

    Parameters
    ----------
    say : tuple of str
        Texts with placeholders such as `{to:.4f}`.
    end : str
        Appended to each text.
    reply : re.Pattern or None
        Found in the line that is the reply; None if no reply is awaited.
    done : re.Pattern or None
        Found in the line that follows the reply and ends it, such as `ok`.
    within_s : float
        Longest time until the reply.
    more : mapping
        Further keys of the table, such as `per_mm`.
    """

    say: tuple[str, ...]
    end: str
    reply: re.Pattern[str] | None
    done: re.Pattern[str] | None
    within_s: float
    more: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Words:
    """The words of one instrument.

    Parameters
    ----------
    name : str
        Name of the instrument, for run.json and errors.
    baud : int
        Speed of the serial port.
    serial : mapping
        Further properties of the serial port, as pyserial names them, such as `rtscts` and `parity`.
    answer_end : str
        End of each line that the instrument sends.
    open_s : float
        Time that the instrument needs after its port was opened, such as a board that restarts then.
    refusal : re.Pattern or None
        Found in a line by which the instrument refuses a command, at whatever time it sends it; the first group, if
        there is one, is the reason.
    actions : mapping of str to Exchange
        Exchanges by the name of their table.
    opening : tuple of Exchange
        Exchanges after the port was opened, in order.
    settings : mapping
        Values of the placeholders that a test bed's file may set.
    """

    name: str
    baud: int
    serial: Mapping[str, Any]
    answer_end: str
    open_s: float
    refusal: re.Pattern[str] | None
    actions: Mapping[str, Exchange]
    opening: tuple[Exchange, ...]
    settings: Mapping[str, str | float]


def known_words() -> tuple[str, ...]:
    """Names of the files of words in the package."""
    return tuple(sorted(path.stem for path in FILES.glob("*.toml")))


def words_of(section: Section, folder: Path, needed: tuple[str, ...]) -> Words:
    """Read the words that a device's section names: `words`, a name of the package or a file, and `set`.

    Parameters
    ----------
    section : Section
        Section of the device in the test bed's file.
    folder : Path
        Folder to which a relative path refers.
    needed : tuple of str
        Tables that the words must have.

    Raises
    ------
    DataError, InputFileError
        There is no such file, or it does not state the words that are needed; the message names the line.
    """
    name = section.word("words")
    if not name.endswith(".toml"):
        section.word("words", of=known_words())
    path = folder / name if name.endswith(".toml") else FILES / f"{name}.toml"
    top = read_section(path, "file of words", (*TOP, *ACTIONS, "open", "settings"), SCHEMA)
    missing = [each for each in needed if each not in top.values]
    if missing:
        top.refuse(None, f"must have [{'], ['.join(needed)}], but has no [{missing[0]}]: add it.")
    settings = _set(section, top.table("settings").values)
    check = top.table("check")
    # Asked once more because its answer fits nothing, a controller that forgets an error once it is read says "none".
    if check.values and not _pattern(check, "reply", settings).groups:
        check.refuse("reply", "must have a group that holds the error, if there is one, as in '^(?:0|(.+))$'.")
    return Words(
        name=top.word("name"),
        baud=section.whole("baud", top.whole("baud", 9600, low=50, high=10_000_000), low=50, high=10_000_000),
        serial=_serial(top.table("serial")),
        answer_end=top.word("answer_end", "\n"),
        open_s=top.number("open_s", 0.0, low=0.0),
        refusal=_pattern(top, "refusal", {}) if "refusal" in top.values else None,
        actions={each: _exchange(top, top.table(each), settings, keys) for each, keys in ACTIONS.items()
                 if each in top.values},
        opening=tuple(_exchange(top, each, settings, (*SAID, "must", "keep")) for each in top.tables("open")),
        settings=settings,
    )  # fmt: skip


def _serial(table: Section) -> Mapping[str, Any]:
    table.only(("rtscts", "xonxoff", "parity", "bytesize", "stopbits"))
    return table.values


def _set(section: Section, defaults: Mapping[str, Any]) -> dict[str, str | float]:
    """Values of the placeholders: the file's own, replaced by those of the table `set` of the test bed's file."""
    stated = section.table("set")
    stated.only(tuple(defaults))
    return {**defaults, **stated.values}


def _exchange(top: Section, table: Section, settings: Mapping[str, Any], keys: tuple[str, ...]) -> Exchange:
    table.only(keys)
    said = table.values.get("say", [])
    lines = (said,) if isinstance(said, str) else tuple(said) if isinstance(said, list) else None
    if lines is None or not all(isinstance(each, str) for each in lines):
        table.refuse("say", f"must be a text or a list of texts, but is {said!r}.")
    # Only a motion has a target and a speed: a stop that asks for them could not be said.
    values = {**({"to": 0.0, "speed": 0.0} if "speed_per_mm_s" in keys else {}), **settings}
    for line in lines:
        _check_placeholders(table, "say", line, values)
    if "stop" in table.values:
        _check_placeholders(table, "stop", table.word("stop"), values)
    if "moving" in keys and "moving_bits" not in table.values:
        _pattern(table, "moving", settings)
    for key in (*SCALES, "keep"):
        if isinstance(table.values.get(key), str):
            table.word(key, of=tuple(settings))
        elif key in table.values:
            table.number(key)
    return Exchange(
        say=lines,
        end=table.word("line_end", top.word("line_end", "\n")),
        reply=_pattern(table, "reply", settings) if "reply" in table.values else None,
        done=_pattern(table, "done", settings) if "done" in table.values else None,
        within_s=table.number("answer_s", top.number("answer_s", ANSWER_S, above=0.0), above=0.0),
        more={key: settings.get(value, value) if key in SCALES else value
              for key, value in table.values.items() if key not in SAID},
    )  # fmt: skip


def _check_placeholders(table: Section, key: str, line: str, values: Mapping[str, str | float]) -> None:
    """Refuse a text with a placeholder that has no value when it is said."""
    try:
        filled(line, values)
    except (KeyError, IndexError, ValueError) as error:
        known = f"but {', '.join(values)}" if values else "in this table"
        table.refuse(key, f"must have no placeholders {known}, each as {{to:.4f}}, but is {line!r} ({error}).")


def _pattern(section: Section, key: str, settings: Mapping[str, Any]) -> re.Pattern[str]:
    """Compile a regular expression in which `{name}` stands for the value of a setting."""
    words = section.word(key)
    given = {name: re.escape(str(value)) for name, value in settings.items()}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # an expression that a later Python reads otherwise
            return re.compile(NAME.sub(lambda found: given.get(found[1], found[0]), words))
    except (re.error, FutureWarning) as error:
        section.refuse(key, f"must be a regular expression, but is {words!r} ({error}).")


def filled(text: str, values: Mapping[str, str | float]) -> str:
    """Replace the placeholders of a text by values."""
    return Formatter().vformat(text, (), values)


def number_in(found: re.Match[str], who: str) -> float:
    """The number in a reply: its first group, or all that was found.

    Raises
    ------
    DataError
        The reply is no number.
    """
    words = found[1] if found.re.groups else found[0]
    try:
        return float(words)
    except (TypeError, ValueError):
        group = "" if found.re.groups else ": put a group, ( ), around the number in its reply"
        raise DataError(f"{who} must answer with a number, but answered {found.string!r}{group}.") from None
