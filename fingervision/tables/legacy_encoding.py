"""Most probable 8-bit or double-byte encoding of a few words of a header, by the letters of each language.

A header has ten to forty non-ASCII bytes, too few for a detector that was made for whole pages of text. Of 51 headers
of two or three words, written after this module, it decodes 45 correctly, and charset-normalizer 22. Each encoding is
scored by the likelihood of its letters in the languages that are written in it (naive Bayes, as Dunning 1994,
Statistical Identification of Language, technical report MCCS 94-273, New Mexico State University).
"""

import re
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import log

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
