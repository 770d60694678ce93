"""Plain files: text in UTF-8, TOML and JSON are read, TOML is written; pipes and devices are refused."""

import codecs
import errno
import json
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any, NoReturn

from fingervision.domain.errors import OutputError

SAVE_AS_UTF8 = "open it in a text editor and save it with the encoding UTF-8"
SAMPLE_BYTES = 1 << 16
"""Part of a file that is searched for zero bytes."""


def plain(path: Path) -> Path:
    """Return a path if it is a file that can be read to its end; refuse pipes and devices.

    Parameters
    ----------
    path : Path
        Path of a file that is to be read.

    Returns
    -------
    Path
        The same path; also for a missing file or a folder, which cause an error when they are opened.

    Raises
    ------
    OSError
        The path is a pipe, a socket or a device.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.ESPIPE, "it is a pipe or a device: save it as a file first", str(path))
    return path


class NotUtf8Error(ValueError):
    """A text file has another encoding than UTF-8; the message states the encoding and the remedy."""


def text_of(path: Path) -> str:
    """Return the text of a file in UTF-8, with or without a byte-order mark.

    Raises
    ------
    OSError
        The file cannot be read, or is a pipe, a socket or a device.
    NotUtf8Error
        The file is UTF-16, or is not UTF-8 for another reason.
    """
    content = plain(path).read_bytes()
    # Documents have no zero bytes. In UTF-16 every second byte of ASCII text is zero.
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or b"\0" in content[:SAMPLE_BYTES]:
        what = "it holds zero bytes, as text in UTF-16 does (Windows calls it Unicode)"
        raise NotUtf8Error(f"{what}: {SAVE_AS_UTF8}")
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = f"byte 0x{content[error.start]:02x} in line {line} belongs to another encoding"
        raise NotUtf8Error(f"{found}: {SAVE_AS_UTF8}") from error


def toml_of(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file; the errors are those of `text_of`, and ValueError for other text than TOML."""
    tables: dict[str, Any] = parsed(tomllib.loads, text_of(path))
    return tables


def json_of(path: Path) -> Any:
    """Return the content of a JSON file; the errors are those of `text_of`, and ValueError for other text than JSON."""
    return parsed(_json, text_of(path))


def parsed(parser: Callable[[str], Any], text: str) -> Any:
    """Parse a document; brackets nested more deeply than the parser can follow are an error of the text.

    Raises
    ------
    ValueError
        The text is not a document of this kind.
    """
    try:
        return parser(text)
    except RecursionError:
        raise ValueError("its brackets are nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        # The parser names a table by a tuple of its keys: ('drive', 'body') is [drive.body].
        keys = r"\(('[^']*'(?:, '[^']*')*),?\)"
        words = re.sub(keys, lambda found: "[" + found[1].replace("', '", ".").strip("'") + "]", str(error))
        raise ValueError(words) from None


def _json(text: str) -> Any:
    return json.loads(text, parse_constant=_no_constant)


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is given where a number is needed")


def why(error: Exception) -> str:
    """Reason stated by a system error, without error number and path, for a message that names the file separately."""
    return (error.strerror or str(error)) if isinstance(error, OSError) else str(error)


def in_utf8(path: Path, text: str) -> str:
    """Return a text unchanged if UTF-8 can encode it, and refuse it otherwise; file names may contain other characters.

    Raises
    ------
    OutputError
        The text contains a file name that UTF-8 cannot encode.
    """
    try:
        text.encode()
    except UnicodeEncodeError as error:
        line = next(each for each in text.splitlines() if error.object[error.start] in each)
        raise OutputError(
            f"{path.name} is written in UTF-8, but would contain a file name that UTF-8 cannot encode "
            f"({line.strip()[:200]!a}): rename that file and run again."
        ) from error
    return text


# Write TOML: values, tables and lists of tables, so that they are read back exactly.


def toml_value(value: object) -> str:
    """Write a value; a negative number that was rounded to zero becomes 0.0 instead of -0.0."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str | PurePath):
        return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float):
        return repr(float(value) + 0.0)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {toml_value(each)}' for key, each in value.items())} }}"
    if isinstance(value, Sequence):
        return f"[{', '.join(map(toml_value, value))}]"
    return str(value)


def toml_lines(values: Mapping[str, object], header: str = "") -> list[str]:
    """Write a table as lines, with its header; keys without a value are left out."""
    lines = ["", header] if header else []
    return lines + [f"{key} = {toml_value(value)}" for key, value in values.items() if value is not None]
