"""Protocol of the views that the browser page can show: a live measurement or a recording."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from fingervision.frames.source import Description
from fingervision.live.choices import Choices
from fingervision.live.frame_measurement import Seen
from fingervision.live.supervisor import Supervisor
from fingervision.storage.gaps_csv import GapRow

# Messages for users of the live view: numbered, kept for some time, and sent to listeners at once.


MESSAGES_KEPT = 50


@dataclass(frozen=True, slots=True)
class Message:
    """A message for the user, with a number counted from 1."""

    number: int
    name: str
    words: str


MessageListener = Callable[[Message], None]


class Messages:
    """The most recent messages, and the listeners that receive new messages."""

    def __init__(self) -> None:
        self.kept: deque[Message] = deque(maxlen=MESSAGES_KEPT)
        self.listeners: list[MessageListener] = []
        self._said = 0

    def say(self, name: str, words: str) -> None:
        """Send a message to all users."""
        self._said += 1
        message = Message(self._said, name, words)
        self.kept.append(message)
        for listener in self.listeners:
            listener(message)


class View(Protocol):
    """A live measurement or a recording, as used by the browser page and its commands.

    Attributes
    ----------
    out : Path
        Folder for files that the user saves.
    choices : Choices
        Settings that the user chose.
    features : dict
        Additions to the measurement (a model, a test bed) by name, for the commands of each topic.
    supervisor : Supervisor
        Supervisor of all threads and tasks of this view.
    """

    out: Path
    choices: Choices
    features: dict[str, Any]
    supervisor: Supervisor

    @property
    def identity(self) -> str:
        """Number that changes when the numbering of rows starts again."""
        ...

    @property
    def description(self) -> Description:
        """Description of the source."""
        ...

    @property
    def seen(self) -> Seen | None:
        """The displayed frame with its measurement."""
        ...

    @property
    def messages(self) -> deque[Message]:
        """The most recent messages."""
        ...

    @property
    def in_a_hurry(self) -> bool:
        """Whether the measurement is too slow, so that previews should not be rendered."""
        ...

    @property
    def table(self) -> Path | None:
        """File of the complete table; None if the table is incomplete."""
        ...

    @property
    def row_count(self) -> int:
        """Number of rows so far."""
        ...

    @property
    def oldest_row(self) -> int:
        """Number of the oldest row that is still stored."""
        ...

    @property
    def shown_from(self) -> int:
        """Number of the first row that is sent to a newly opened browser page."""
        ...

    def rows(self, first: int, last: int) -> Iterator[GapRow]:
        """Rows with numbers from `first` to `last` - 1."""
        ...

    def choose(self, **changes: Any) -> None:
        """Change settings of measurement or display."""
        ...

    def say(self, name: str, words: str) -> None:
        """Send a message to all users."""
        ...

    def state(self) -> dict[str, Any]:
        """Return the state of source and measurement, for the browser page."""
        ...
