"""Text tables with one row per line: all variants of CSV, COMSOL's `%` tables, columns separated by white space."""

import re
from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.tables.mapping import Entry
from fingervision.tables.raw_table import RawTable
from fingervision.tables.text_file import lines_of
from fingervision.tables.text_table import table_of_lines

ORDER = 100
HEAD_BYTES = 256
OTHERS = {
    b"\xd0\xcf\x11\xe0": "an old Excel file (.xls): save it as .xlsx",
    b"\x1f\x8b": "compressed (gzip): unpack it",
    b"PK": "an archive or a document (.ods, .zip): save the table as .xlsx or .csv",
    b"%PDF": "a PDF: export the table itself",
    b"\x89PNG": "a picture: export the table itself",
    b"\x1a\x45\xdf\xa3": "a video: name the table",
    b"SQLite format": "a database: export the table as .csv",
}
"""First bytes of other kinds of files that users often name by mistake."""
JSON = re.compile(rb"[\xef\xbb\xbf\s]*(\{\s*[\"}]|\[\s*(\{\s*[\"}]|\[))")
"""Beginning of a JSON document: an object with a name, or a list of objects or of lists."""


def recognises(path: Path, head: bytes) -> bool:
    """Accept every file that no other format has recognised."""
    return True


def read(path: Path, given: Entry) -> RawTable:
    """Read a text table."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if JSON.match(head):
        raise DataError(f"{path} must be a table with a row a line, but is a JSON document: export the table as CSV.")
    for magic, words in OTHERS.items():
        if head.startswith(magic):
            raise DataError(f"{path} must be a table, but is {words}.")
    lines, encoding = lines_of(path, given.words.get("encoding"))
    return table_of_lines(path, lines, given, encoding)
