"""Base of the views that the browser page can show: a live measurement or a recording."""

import secrets
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingervision.frames.source import Description
from fingervision.live.choices import ZERO_IS_OFF, Choices
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


class View(ABC):
    """A live measurement or a recording, as the browser page shows it and its commands use it.

    Parameters
    ----------
    description : Description
        Description of the source.
    choices : Choices
        Settings chosen by the user.
    out : Path
        Folder for files that the user saves.
    """

    def __init__(self, description: Description, choices: Choices, out: Path) -> None:
        self.description, self.out = description, out
        self.choices = choices.for_frames(description)
        self.features: dict[str, Any] = {}
        """Additions to the measurement (a model, a test bed) by name, for the commands of each topic."""
        self.seen: Seen | None = None
        """The displayed frame with its measurement."""
        self.messages: deque[Message] = deque(maxlen=MESSAGES_KEPT)
        """The most recent messages."""
        self.on_message: list[MessageListener] = []
        """Listeners that receive every message."""
        self.supervisor = Supervisor(self.say)
        """Supervisor of all threads and tasks of this view."""
        self._said = self._generation = 0
        self._identity = secrets.token_hex(4)

    @property
    def identity(self) -> str:
        """Word that changes when the numbering of rows starts again."""
        return f"{self._identity}-{self._generation}"

    def renew(self) -> None:
        """Send all rows to the browser pages again, because they or what stands beside them have changed."""
        self._generation += 1

    def say(self, name: str, words: str) -> None:
        """Send a message to all users."""
        self._said += 1
        message = Message(self._said, name, words)
        self.messages.append(message)
        for listener in self.on_message:
            listener(message)

    @property
    def in_a_hurry(self) -> bool:
        """Whether the measurement is too slow, so that previews should not be rendered."""
        return False

    @property
    def table(self) -> Path | None:
        """File of the complete table; None if the table is incomplete."""
        return None

    @property
    @abstractmethod
    def row_count(self) -> int:
        """Number of rows so far."""

    @property
    def oldest_row(self) -> int:
        """Number of the oldest row that is still stored."""
        return 0

    @property
    def shown_from(self) -> int:
        """Number of the first row that is sent to a newly opened browser page."""
        return 0

    @abstractmethod
    def rows(self, first: int, last: int) -> Iterator[GapRow]:
        """Rows with numbers from `first` to `last` - 1."""

    def choose(self, **changes: Any) -> None:
        """Change settings of measurement or display.

        Raises
        ------
        DataError, UsageError
            The choice does not fit the frames.
        """
        chosen, unzeroed = self.choices.changed(**changes)
        self.choices = chosen.for_frames(self.description)
        if unzeroed:
            self.say("zero", ZERO_IS_OFF)

    def state(self) -> dict[str, Any]:
        """Return the state of source and measurement, for the browser page."""
        description = self.description
        return {
            "source": description.name,
            "kind": description.kind,
            "width_px": description.width_px,
            "height_px": description.height_px,
            "rate_hz": description.rate_hz,
            "camera": "",
            "jitter_ms": None,
            "dropped": 0,
            "exposure": "",
            "silent_s": 0.0,
            "recording": None,
            "trouble": self.supervisor.trouble,
            **self.choices.state(),
        }
