"""Files with several tables (sheets, groups, structures): choose the table to read."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from fingervision.domain.errors import DataError
from fingervision.tables.mapping import Entry
from fingervision.tables.questions import OpenQuestionError, Question
from fingervision.tables.units import column_name


def chosen_part(path: Path, names: Mapping[str, Sequence[str]], given: Entry, what: str) -> str:
    """Name of the table to read: the one that the user states, the only one, or the only recognisable one.

    Parameters
    ----------
    path : Path
        The file.
    names : mapping of str to sequence of str
        Names of the columns in each part of the file.
    given : Entry
        Decisions of the user.
    what : str
        Word for a part in this file format (sheet, group).

    Raises
    ------
    DataError
        The file has no part with columns of numbers, or does not contain the stated part.
    OpenQuestionError
        Several parts may be the table, and the user has not chosen one.
    """
    listed = ", ".join(f"'{name}'" for name in names)
    if (stated := given.words.get("part")) is not None:
        if stated not in names:
            raise DataError(
                f"The key part must name a {what} of {path} ({listed or 'it has none'}), but is '{stated}'."
            )
        return stated
    if len(names) == 1:
        return next(iter(names))
    known: Callable[[str], int] = lambda part: len({r for n in names[part] if (r := column_name(n).role) is not None})  # noqa: E731
    fitting = [part for part in names if known(part) >= 2]
    if len(fitting) == 1:
        return fitting[0]
    if not names:
        raise DataError(f"{path} must hold a table, but has no {what} with columns of numbers: export it again.")
    example = (fitting or list(names))[0]
    raise OpenQuestionError(
        path, "table", [Question(f"it must be stated which {what} is meant: {listed}", f"part={example}")]
    )
