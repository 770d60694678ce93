"""Open questions about a table, each with the key of columns.toml that resolves the question."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import FingervisionError


@dataclass(frozen=True, slots=True)
class Question:
    """One open question about a table.

    Parameters
    ----------
    words : str
        The question as a clause without a full stop.
    key : str
        The key that resolves the question, with an example of a value: `units.input=mm`.
    missing : str
        Name in fingervision of a required column that was not found in the table; empty for any other question.
    """

    words: str
    key: str
    missing: str = ""


class OpenQuestionError(FingervisionError):
    """A table can be read in more than one way; the message names the key of columns.toml that resolves the ambiguity.

    Parameters
    ----------
    path : Path
        The table.
    kind : str
        Kind as which the table was to be read: `measured`, `drive`, `simulation`, or `table` if not known yet.
    questions : sequence of Question
        At least one open question.
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
            f"{path} {begin}: {open_points}. State it once with this command, then repeat the first one: "
            f"fingervision table {name}{asked} {keys}"
        )


def _quoted(words: str) -> str:
    """Quote a text for the command line of a shell."""
    from shlex import quote

    return quote(words)
