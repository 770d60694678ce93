"""Text encoding of a table: byte-order marks, UTF-8, UTF-16 without a byte-order mark, and older encodings."""

import codecs
import re

from fingervision.domain.errors import DataError
from fingervision.tables.legacy_encoding import most_likely_encodings

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
SAMPLE_BYTES = 65536
BEYOND_ASCII = re.compile(rb"[\x80-\xff]")
WIDE = ["utf_16", "utf_16_be", "utf_16_le", "utf_32", "utf_32_be", "utf_32_le", "utf_7"]


def decode(content: bytes, given: str | None = None) -> tuple[str, str]:
    """Decode the bytes of a table to text.

    Parameters
    ----------
    content : bytes
        Content of the complete file.
    given : str or None
        Encoding stated by the user; None if it is to be recognised.

    Returns
    -------
    str, str
        The text, and the name of the encoding.

    Raises
    ------
    DataError
        The stated encoding does not fit, or no known encoding fits.
    """
    if given is not None:
        try:
            return content.decode(given).removeprefix("\ufeff"), given
        except (LookupError, UnicodeDecodeError) as error:
            raise DataError(
                f"encoding must be the encoding of the table, but {given} does not fit ({error}): leave "
                "this setting out, or name another encoding."
            ) from error
    for mark, name in MARKS:
        if content.startswith(mark):
            return content.decode(name, errors="replace"), name
    if (without_mark := _utf16_without_mark(content[:SAMPLE_BYTES])) is not None:
        return content.decode(without_mark, errors="replace"), without_mark
    try:
        return content.decode("utf-8"), "utf-8"
    except UnicodeDecodeError as error:
        # A UTF-8 file may be cut off within a character.
        if error.start > len(content) - 4 and error.reason == "unexpected end of data":
            return content[: error.start].decode("utf-8"), "utf-8"
    return _older(content)


def _utf16_without_mark(sample: bytes) -> str | None:
    """Recognise UTF-16 by zero bytes: in ASCII text encoded as UTF-16, every second byte is zero."""
    if len(sample) < 4:
        return None
    zeros = [sample[start::2].count(0) / len(sample[start::2]) for start in (0, 1)]
    # In any table, at least half of the characters are digits and separators.
    if zeros[1] > 0.5 and zeros[0] < 0.1:
        return "utf-16-le"
    return "utf-16-be" if zeros[0] > 0.5 and zeros[1] < 0.1 else None


def _older(content: bytes) -> tuple[str, str]:
    """Decode an older encoding: by the letters of known languages, otherwise as charset-normalizer detects."""
    sample = _lines_beyond_ascii(content)
    for encoding in most_likely_encodings(sample):
        try:
            return content.decode(encoding), encoding
        except UnicodeDecodeError:
            continue
    from charset_normalizer import from_bytes

    # UTF-16 and UTF-32 are recognised by byte-order marks or zero bytes before; here they would accept any text of even
    # length.
    best = from_bytes(sample, cp_exclusion=WIDE).best()
    if best is not None:
        try:
            return content.decode(best.encoding), best.encoding
        except UnicodeDecodeError:
            pass
    return content.decode("latin-1"), "latin-1"


def _lines_beyond_ascii(content: bytes) -> bytes:
    """Join the first lines that contain non-ASCII characters, up to the size of a sample."""
    lines: list[bytes] = []
    at = size = 0
    while size < SAMPLE_BYTES and (found := BEYOND_ASCII.search(content, at)) is not None:
        begin = max(content.rfind(b"\n", 0, found.start()), content.rfind(b"\r", at, found.start())) + 1
        ends = [end for end in (content.find(b"\n", found.end()), content.find(b"\r", found.end())) if end >= 0]
        at = min(ends, default=len(content))
        lines.append(content[begin : min(at, begin + SAMPLE_BYTES)])
        size += len(lines[-1])
    return b"\n".join(lines)
