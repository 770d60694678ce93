"""Protocol of what the page shows: a continuous source, or a recording; both have the same interface."""

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

from fingervision.frames.source import Description
from fingervision.live.choices import Choices
from fingervision.live.frame_measurement import Seen
from fingervision.live.messages import Message
from fingervision.storage.gaps_csv import GapRow


class View(Protocol):
    """A live measurement or a recording, as used by the page and its commands.

    Attributes
    ----------
    out : Path
        Folder for files that the user saves.
    choices : Choices
        Settings that the user chose.
    features : dict
        Additions to the measurement (a model, a bed) by name, where the commands of that topic find them.
    """

    out: Path
    choices: Choices
    features: dict[str, Any]

    @property
    def identity(self) -> str:
        """A number that changes when rows are counted from the beginning."""
        ...

    @property
    def description(self) -> Description:
        """The source."""
        ...

    @property
    def seen(self) -> Seen | None:
        """The picture that is shown."""
        ...

    @property
    def messages(self) -> deque[Message]:
        """The latest messages."""
        ...

    @property
    def in_a_hurry(self) -> bool:
        """Whether previews should not be drawn now."""
        ...

    @property
    def table(self) -> Path | None:
        """The complete table as a file, where there is one."""
        ...

    @property
    def row_count(self) -> int:
        """Number of rows so far."""
        ...

    @property
    def oldest_row(self) -> int:
        """Number of the first row that is still kept."""
        ...

    @property
    def shown_from(self) -> int:
        """Number of the first row sent to a page that has none."""
        ...

    def rows(self, first: int, last: int) -> Iterator[GapRow]:
        """Rows from number `first` up to but excluding `last`."""
        ...

    def choose(self, **changes: Any) -> None:
        """Change settings of measurement or display."""
        ...

    def say(self, name: str, words: str) -> None:
        """Send a message to all users."""
        ...

    def state(self) -> dict[str, Any]:
        """State of source and measurement, for the page."""
        ...
