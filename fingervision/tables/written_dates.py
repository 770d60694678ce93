"""Dates with the month as a word, in compact ISO 8601, and durations with days, rewritten to the usual notation."""

import re

MONTH_WORDS = (
    "jan january januar janv", "feb february februar fev", "mar march mrz marz", "apr april avr", "may mai",
    "jun june juni juin", "jul july juli juil", "aug august aout", "sep sept september", "oct october okt oktober",
    "nov november", "dec december dez dezember",
)  # fmt: skip
MONTHS = {word: number for number, words in enumerate(MONTH_WORDS, start=1) for word in words.split()}
"""Months in English, German and French, in lower case and without accents."""
WORD = r"(?P<month>[A-Za-zäéû]{3,9})\.?"
CLOCK = r"(?P<clock>\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?:\s*[AaPp]\.?[Mm]\.?)?)?"
WITH_WORD = (
    re.compile(
        rf"(?:[A-Za-z]{{2,9}},?\s+)?(?P<day>\d{{1,2}})\.?[-\s/]{WORD}[-\s/,]\s*(?P<year>\d{{4}}|\d\d)[T,:\s]*{CLOCK}"
    ),
    re.compile(rf"(?:[A-Za-z]{{2,9}},?\s+)?{WORD}\s+(?P<day>\d{{1,2}}),?\s+(?P<year>\d{{4}}),?\s*{CLOCK}"),
    re.compile(rf"[A-Za-z]{{3}}\s+{WORD}\s+(?P<day>\d{{1,2}})\s+{CLOCK}\s+(?P<year>\d{{4}})"),
)
"""`23-Nov-2026 13:24:07`, `Nov 23, 2026 13:24`, and the order of C's `ctime`: `Mon Nov 23 13:24:07 2026`."""
COMPACT = re.compile(r"(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)([.,]\d+)?(Z|[+-]\d{2}:?\d{2})?")
WITH_DAYS = re.compile(r"(?P<days>\d+) days?,? (?P<clock>\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?)")
PLAIN = str.maketrans("äéû", "aeu")


def rewritten(text: str) -> str:
    """Rewrite a date as `2026-11-23 13:24:07`; any other text is returned unchanged.

    Examples
    --------
    >>> rewritten("23-Nov-2026 13:24:07.5"), rewritten("Mon Nov 23 13:24:07 2026"), rewritten("20261123T132407Z")
    ('2026-11-23 13:24:07.5', '2026-11-23 13:24:07', '2026-11-23 13:24:07Z')
    >>> rewritten("Nov 3, 2026 1:24 PM"), rewritten("13:24:07")
    ('2026-11-03 1:24 PM', '13:24:07')
    """
    if (compact := COMPACT.fullmatch(text)) is not None:
        year, month, day, hours, minutes, seconds, fraction, zone = compact.groups()
        return f"{year}-{month}-{day} {hours}:{minutes}:{seconds}{fraction or ''}{zone or ''}"
    if not any(map(str.isalpha, text)):
        return text
    for pattern in WITH_WORD:
        match = pattern.fullmatch(text)
        month = MONTHS.get(match["month"].lower().translate(PLAIN)) if match is not None else None
        if match is not None and month is not None:
            year = match["year"] if len(match["year"]) == 4 else f"20{match['year']}"
            return f"{year}-{month:02}-{int(match['day']):02} {match['clock'] or ''}".rstrip()
    return text


def days_and_clock(text: str) -> tuple[int, str] | None:
    """Split a duration with days.

    Examples
    --------
    >>> days_and_clock("1 days 00:00:00.5")
    (1, '00:00:00.5')
    """
    match = WITH_DAYS.fullmatch(text)
    return None if match is None else (int(match["days"]), match["clock"])
