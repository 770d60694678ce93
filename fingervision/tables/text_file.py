"""Reading of the lines of a text file, with a limit on the size of the file."""

import codecs
import re
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import log
from pathlib import Path

from fingervision.domain.errors import DataError, FingervisionError, InputFileError

# Most probable 8-bit or double-byte encoding of a few words of a header, by the letters of each language.
#
# A header has ten to forty non-ASCII bytes, too few for a detector that was made for whole pages of text. Of 51 headers
# of two or three words, written after this module, it decodes 45 correctly, and charset-normalizer 22. Each encoding is
# scored by the likelihood of its letters in the languages that are written in it (naive Bayes, as Dunning 1994,
# Statistical Identification of Language, technical report MCCS 94-273, New Mexico State University).

RUSSIAN = "оеаинтсрвлкмдпуяызьбгчйхжшюцщэф"
"""Letters of Russian in the order of their frequency; the last letters ъ and ё are as rare as any other."""
GREEK = "αοιετσνηυρπκμλςθγδχφβξζψόίάέήύώ"
HIRAGANA_KATAKANA = "".join(chr(code) for code in (*range(0x3041, 0x3094), *range(0x30A1, 0x30F7), 0x30FC))
WESTERN = "éäüöèóàíáñçúßêôìòùâîûåøæëïãœÿõ"
CENTRAL_EUROPEAN = "óáéíąłęčěřžšýőűćńśźżňťůúďöü"
TURKISH = "\u0131şğüçö"
"""Letters of the languages that share an encoding, most frequent first."""
SIGNS = {"µ": 0.2, "°": 0.1, **dict.fromkeys("²³±·…€§«»\u00d7\u2013\u2014\u2018\u2019\u201c\u201d\xa0", 0.01)}
"""Probabilities of the signs in any table: units, quotation marks, dashes."""
UNITS = dict.fromkeys("\u339c\u339b\u339d\u2103", 0.02)
"""Probability of mm, µm, cm and °C as one character, which double-byte encodings have."""
CHINESE = (
    "时间位移置力输入出隙开口度序号测量编码器夹爪行程距离速压电流通道数据值实验模拟仿真左右手指毫米秒微牛顿日期次循环"
    "目标偏差方向误载荷重驱动台平机械传感信频率温编码点名称单位备注结果"
)
CHINESE_TRADITIONAL = (
    "時間位移置力輸入出隙開口度序號測量編碼器夾爪行程距離速壓電流通道數據值實驗模擬仿真左右手指毫米秒微牛頓日期次循環"
    "目標偏差方向誤載荷重驅動台平機械傳感信頻率溫點名稱單備註結果"
)
JAPANESE = "時間位置変隙隔開口入力出荷重秒測定距離左右指値実験計算番号目標偏差方向速度電圧電流温日付回数駆動幅"
KOREAN = "시간위치변간격극입력출힘측정거리하중초좌우손가락값실험계산번호목표편차방향속도전압류온날짜횟수구동폭열림"
LIKELY = 0.7
"""Probability that a letter of a header is one of the usual letters of the language."""
NEXT_LETTER = 0.89
"""Probability of a letter over that of the next more frequent one: in Russian from 11 % down to 0.3 %."""
CAPITALISED, CAPITALS = 0.3, 0.1
"""Probability that a word begins with a capital, and that it has only capitals."""
ODD = 0.01
"""Probability of sequences that hardly occur within a word: a capital after a small letter, letters of two alphabets, a
sign. A capital after a small letter distinguishes KOI8-R from Windows-1251, in which small and capital letters have
exchanged codes."""
BESIDE_ANOTHER = 0.15
"""Probability of an accented letter beside another one, relative to one by itself: `größe`, `ölçü`."""
LEAST = -6.0
"""Mean logarithm of the likelihood of a byte below which no language fits. Random letters from the 94 x 94 codes of a
double-byte set would have -4.5, but are not the usual letters of any language."""


@dataclass(frozen=True, slots=True, eq=False)
class Language:
    """Letters of a language, and the encodings in which tables in that language are stored.

    Parameters
    ----------
    encodings : tuple of str
        Encodings, the most usual first.
    letters : mapping of str to float
        Probability of each usual non-ASCII letter.
    others : int
        Number of other letters that may occur.
    other_letters : pattern
        Pattern of these other letters; any further character is nearly impossible.
    is_latin : bool
        Whether most of its letters are ASCII.
    """

    encodings: tuple[str, ...]
    letters: dict[str, float]
    others: int
    other_letters: re.Pattern[str]
    is_latin: bool = False


def _even(letters: str) -> dict[str, float]:
    return dict.fromkeys(letters, LIKELY / len(set(letters))) | UNITS


def _by_rank(letters: str) -> dict[str, float]:
    """Probabilities of one language's letters: each letter is rarer than the previous one by the same factor."""
    return _shares(letters, [NEXT_LETTER**rank for rank in range(len(letters))])


def _of_several(letters: str) -> dict[str, float]:
    """Probabilities of the letters of several languages together, which decrease linearly with the rank."""
    return _shares(letters, [float(len(letters) - rank) for rank in range(len(letters))])


def _shares(letters: str, weights: list[float]) -> dict[str, float]:
    total = sum(weights)
    return {letter: LIKELY * weight / total for letter, weight in zip(letters, weights, strict=True)} | SIGNS


LATIN_LETTERS = re.compile(r"[\u00c0-\u024f]")
HAN = re.compile(r"[\u4e00-\u9fff\uff08\uff09\uff1a\u3001\u3002]")
LANGUAGES = (
    Language(("cp1252", "mac_roman", "cp850", "cp437"), _of_several(WESTERN), 600, LATIN_LETTERS, is_latin=True),
    Language(("cp1250", "iso8859-2"), _of_several(CENTRAL_EUROPEAN), 600, LATIN_LETTERS, is_latin=True),
    Language(("cp1254",), _by_rank(TURKISH), 600, LATIN_LETTERS, is_latin=True),
    Language(("cp1251", "koi8-r", "cp866"), _by_rank(RUSSIAN), 400, re.compile(r"[\u0400-\u045f№]")),
    Language(("cp1253",), _by_rank(GREEK), 400, re.compile(r"[\u0386-\u03ce]")),
    Language(("gb18030",), _even(CHINESE), 3755, HAN),
    Language(("big5",), _even(CHINESE_TRADITIONAL), 5401, HAN),
    Language(("cp932", "euc_jp"), _even(JAPANESE + HIRAGANA_KATAKANA), 2965, HAN),
    Language(("cp949",), _even(KOREAN), 2350, re.compile(r"[\uac00-\ud7a3]")),
)
WESTERN_FIRST = 1.0
"""Logarithm of the prior odds of a Western encoding over another: at equal likelihood, such as for a single `µ`, the
Western encoding is chosen."""

SELDOMER = 0.5
"""Logarithm of the prior odds of an encoding over the next one of the same language."""


def most_likely_encodings(sample: bytes) -> list[str]:
    """Encodings in which a sample is text of a known language, the most probable first; empty if there are none.

    Parameters
    ----------
    sample : bytes
        Lines of a table that are not ASCII.

    Examples
    --------
    >>> [most_likely_encodings(header)[0] for header in ("时间,开口".encode("gbk"), "Сила;Зазор".encode("koi8-r"))]
    ['gb18030', 'koi8-r']
    """
    size = sum(byte > 127 for byte in sample)
    found: dict[str, float] = {}
    for language in LANGUAGES:
        for rank, encoding in enumerate(language.encodings):
            try:
                text = sample.decode(encoding)
            except UnicodeDecodeError:
                continue
            score = _log_likelihood(text, language)
            if score < LEAST * size:
                continue
            score += (WESTERN_FIRST if encoding == "cp1252" else 0.0) - SELDOMER * rank
            found[encoding] = max(score, found.get(encoding, -float("inf")))
    return sorted(found, key=lambda encoding: -found[encoding])


def _log_likelihood(text: str, language: Language) -> float:
    """Logarithm of the probability of a text's non-ASCII characters, and of the words in which they are."""
    total = 0.0
    for word in re.findall(r"[^\W\d_]+|[^\w\s]", text):
        if word.isascii():
            continue
        total += sum(_log_letter(letter.lower(), language) for letter in word if not letter.isascii())
        total += log(_form(word))
        letters = word.replace("µ", "") if word.startswith("µ") else word
        if language.is_latin:
            accented = sum(not (one.isascii() or two.isascii()) for one, two in pairwise(letters))
            total += accented * log(BESIDE_ANOTHER)
        elif len({letter.isascii() for letter in letters}) > 1:
            total += log(ODD)
    # An ellipsis before a letter is probably an Ö in another encoding.
    return total + log(ODD) * len(re.findall(r"…\w", text))


def _form(word: str) -> float:
    """Probability of the sequence of small letters, capital letters and signs in a word."""
    if "µ" in word[1:] or "ς" in word[:-1]:
        return ODD
    if word == word.lower():
        return 1.0 - CAPITALISED - CAPITALS
    if word.isupper() and len(word) > 1:
        return CAPITALS
    return CAPITALISED if word[1:] == word[1:].lower() else ODD


@cache
def _log_letter(letter: str, language: Language) -> float:
    if (share := language.letters.get(letter)) is not None:
        return log(share)
    if language.other_letters.match(letter):
        return log((1.0 - LIKELY) / language.others)
    return log(1e-7)


# Text encoding of a table: byte-order marks, UTF-8, UTF-16 without a byte-order mark, and older encodings.

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


MOST_BYTES = 1_000_000_000
"""Largest size of a file, because cells as text need about ten times the size of the file in memory."""
HEAD_LINES, MOST_IN_CELL = 40, 12
"""Number of lines in which a header with line ends in its cells is looked for, and the most lines of such a header."""
LONGEST_LINE = 1_000_000
"""Longest line in characters; only a file without line ends, not a table, has longer lines."""


def lines_of(path: Path, encoding: str | None) -> tuple[list[str], str]:
    """Read all lines of a text file.

    Returns
    -------
    list of str, str
        Lines, and the name of the encoding.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, is too large, is not text, or has a line of more than `LONGEST_LINE` characters.
    """
    try:
        with path.open("rb") as file:
            # The first line is checked before the whole file is read, because a file of one line is often huge. UTF-32
            # has four bytes per character.
            head = file.read(4 * LONGEST_LINE)
            if len(head) == 4 * LONGEST_LINE and b"\n" not in head and b"\r" not in head:
                raise _too_long(path)
            size = path.stat().st_size
            if size > MOST_BYTES:
                raise DataError(
                    f"{path} must have at most {MOST_BYTES / 1e9:g} GB to be read as text, but has {size / 1e9:.1f} "
                    "GB: split it, or save it as Parquet."
                )
            content = head + file.read()
    except OSError as error:
        raise InputFileError(f"The table {path} could not be read ({error.strerror}).") from error
    text, name = decode(content, encoding)
    if "\x00" in text:
        # If a logger loses power, its file may end with zero bytes.
        text = text.rstrip("\x00")
        if "\x00" in text:
            raise DataError(
                f"{path} must be a text table, or a file of a supported format (.xlsx, .mat, .parquet, .tdms, .lvm), "
                f"but holds zero bytes (the first is character {text.index(chr(0))}): export it again."
            )
    lines = with_whole_cells(text.splitlines())
    if lines and max(map(len, lines)) > LONGEST_LINE:
        raise _too_long(path)
    return lines, name


def with_whole_cells(lines: list[str]) -> list[str]:
    """Join the lines of a header cell in quotes that contains line ends, as spreadsheets write it.

    The lines that were joined become blank, so that all others keep their numbers.

    Examples
    --------
    >>> with_whole_cells(['"Time', '[s]","Gap', '[mm]"', "0,1"])
    ['"Time [s]","Gap [mm]"', '', '', '0,1']
    """
    for at in range(min(len(lines), HEAD_LINES)):
        line = lines[at]
        if '"' not in line or line.count('"') % 2 == 0:
            continue
        for end in range(at + 1, min(len(lines), at + 1 + MOST_IN_CELL)):
            line = f"{line} {lines[end].strip()}"
            if line.count('"') % 2 == 0 and '"' in lines[end]:
                return [*lines[:at], line, *[""] * (end - at), *with_whole_cells(lines[end + 1 :])]
    return lines


def _too_long(path: Path) -> FingervisionError:
    return DataError(
        f"{path} must be a table with a row a line, but has a line of more than {LONGEST_LINE} characters: export it "
        "with line ends."
    )
