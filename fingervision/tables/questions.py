"""Open questions about a table, each with the key of columns.toml that answers it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import FingervisionError


@dataclass(frozen=True, slots=True)
class Question:
    """One open point.

    Parameters
    ----------
    words : str
        What is open, a clause without a full stop.
    key : str
        The key that decides, with an example of its value: `units.input=mm`.
    missing : str
        Our name of the column that no name in the table stands for; empty where it is another question.
    """

    words: str
    key: str
    missing: str = ""


class OpenQuestionError(FingervisionError):
    """A table can be read in more than one way; the message names the key of columns.toml that decides.

    Parameters
    ----------
    path : Path
        The table.
    kind : str
        What it was to be read as: `measured`, `drive`, `simulation`, or `table` where that is not known yet.
    questions : sequence of Question
        At least one.
    """

    def __init__(self, path: Path, kind: str, questions: Sequence[Question]) -> None:
        self.path, self.kind, self.questions = path, kind, tuple(questions)
        open_points = "; ".join(each.words for each in questions)
        missing = " and a column ".join(each.missing for each in questions if each.missing)
        keys = " ".join(f"--set {_quoted(each.key)}" for each in questions)
        name = _quoted(str(path))
        words = kind if kind in ("drive", "table") else f"{kind} table"
        asked = f" --as {kind}" if kind != "table" else ""
        begin = f"must have a column {missing}" if missing else f"cannot be read as a {words} without a decision"
        super().__init__(
            f"{path} {begin}: {open_points}. Say it once, then call again: fingervision table {name}{asked} {keys}"
        )


def _quoted(words: str) -> str:
    """Quote a word for the shell."""
    from shlex import quote

    return quote(words)
