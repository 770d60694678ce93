"""Text encoding of a table: byte-order marks, UTF-8, UTF-16 without a byte-order mark, and older encodings."""

import codecs

from fingervision.domain.errors import DataError

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
WESTERN = frozenset(
    "äöüÄÖÜßàâçéèêëîïôùûüÿæœÀÂÇÉÈÊËÎÏÔÙÛÜŸñÑáíóúÁÍÓÚ¿¡ìòÌÒãõÃÕåÅøØ°µ²³±·„…€§«»\xa0"
    "\u00d7\u2013\u2014\u2018\u2019\u201c\u201d"
)
"""Non-ASCII characters that are usual in Western languages; any other character indicates another encoding."""
SAMPLE_BYTES = 65536


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
        The stated encoding does not fit, or none does.
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
        # A file that was cut off within a character is UTF-8 still.
        if error.start > len(content) - 4 and error.reason == "unexpected end of data":
            return content[: error.start].decode("utf-8"), "utf-8"
    return _older(content)


def _utf16_without_mark(sample: bytes) -> str | None:
    """Recognise UTF-16 by zero bytes: in ASCII text encoded as UTF-16, every second byte is zero."""
    if len(sample) < 4:
        return None
    zeros = [sample[start::2].count(0) / len(sample[start::2]) for start in (0, 1)]
    # Half of the characters and more are digits and separators in any table.
    if zeros[1] > 0.5 and zeros[0] < 0.1:
        return "utf-16-le"
    return "utf-16-be" if zeros[0] > 0.5 and zeros[1] < 0.1 else None


def _older(content: bytes) -> tuple[str, str]:
    """Decode an 8-bit encoding: as Western European if only usual characters result, otherwise by charset-normalizer.

    A header has too few non-ASCII bytes for the statistics of charset-normalizer, so that the most frequent case is
    decided by a rule.
    """
    try:
        text = content.decode("cp1252")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if {letter for letter in set(text) if ord(letter) > 127} <= WESTERN:
        return text, "cp1252"
    from charset_normalizer import from_bytes

    odd = b"\n".join(line for line in content.splitlines() if not line.isascii())[:SAMPLE_BYTES]
    best = from_bytes(odd).best()
    if best is None:
        return text, "latin-1"
    try:
        return content.decode(best.encoding), best.encoding
    except UnicodeDecodeError:
        return text, "latin-1"
