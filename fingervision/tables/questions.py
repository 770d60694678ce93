"""Open questions about a table, each with the key of columns.toml that resolves the question."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError


@dataclass(frozen=True, slots=True)
class Reading:
    """One way to read what a question is about.

    Parameters
    ----------
    key : str
        The key that chooses this reading: `units.input=mm`.
    gives : str
        The numbers that the table then holds: `0.61 to 1.39 mm`.
    """

    key: str
    gives: str


@dataclass(frozen=True, slots=True)
class Question:
    """One open question about a table.

    Parameters
    ----------
    words : str
        The question as a clause without a full stop.
    key : str
        The key that resolves the question by the most probable reading.
    missing : str
        Name in fingervision of a required column that was not found in the table; empty for any other question.
    readings : tuple of Reading
        The readings among which the user chooses, the most probable first; empty if only one key answers.
    """

    words: str
    key: str
    missing: str = ""
    readings: tuple[Reading, ...] = ()

    @property
    def told(self) -> str:
        """The question with each reading, its key, and the numbers that it gives."""
        listed = " or ".join(f"{each.key} ({each.gives})" for each in self.readings)
        return f"{self.words}: {listed}" if listed else self.words


def asked(words: str, readings: Sequence[Reading], missing: str = "") -> Question:
    """Question between readings, of which the first is the most probable."""
    return Question(words, readings[0].key, missing, tuple(readings))


def span(value: NDArray[np.float64], unit: str = "") -> str:
    """Range of a column's numbers in words.

    Examples
    --------
    >>> span(np.array([0.61, 1.39, 0.7]), "mm")
    '0.61 to 1.39 mm'
    """
    return f"{value.min():.6g} to {value.max():.6g} {unit}".strip() if value.size else "no numbers"


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
        open_points = "; ".join(each.told for each in questions)
        missing = " and a column ".join(each.missing for each in questions if each.missing)
        keys = " ".join(f"--set {_quoted(each.key)}" for each in questions)
        name = _quoted(str(path))
        words = kind if kind in ("drive", "table") else f"{kind} table"
        use = f" --kind {kind}" if kind != "table" else ""
        pick = ", with the keys of the readings that are right," if any(len(q.readings) > 1 for q in questions) else ","
        begin = f"must have a column {missing}" if missing else f"cannot be read as a {words} without a decision"
        super().__init__(
            f"{path} {begin}: {open_points}. State it once with this command{pick} then repeat the first one: "
            f"fingervision table {name}{use} {keys}"
        )


def _quoted(words: str) -> str:
    """Quote a text for the command line of a shell."""
    from shlex import quote

    return quote(words)
