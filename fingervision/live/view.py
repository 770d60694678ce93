"""What the page shows: a source that goes on, or a recording that is looked through; both answer alike."""

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
    """A live measurement or a recording, as the page and its commands know it.

    Attributes
    ----------
    out : Path
        Folder for what the user keeps.
    choices : Choices
        What the user chose.
    features : dict
        What stands beside the measurement (a model, a bed), by name; commands of that concern find it there.
    """

    out: Path
    choices: Choices
    features: dict[str, Any]

    @property
    def identity(self) -> str:
        """Changes when rows are counted anew."""
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
        """What was said last."""
        ...

    @property
    def in_a_hurry(self) -> bool:
        """Whether nobody should draw previews now."""
        ...

    @property
    def table(self) -> Path | None:
        """The whole table as a file, where there is one."""
        ...

    @property
    def row_count(self) -> int:
        """Rows that there have been."""
        ...

    @property
    def oldest_row(self) -> int:
        """Number of the first row that is still kept."""
        ...

    @property
    def shown_from(self) -> int:
        """Number of the first row that a page which has none is sent."""
        ...

    def rows(self, first: int, last: int) -> Iterator[GapRow]:
        """Rows from one number on, before another."""
        ...

    def choose(self, **changes: Any) -> None:
        """Change what is measured or shown."""
        ...

    def say(self, name: str, words: str) -> None:
        """Tell everybody who looks."""
        ...

    def state(self) -> dict[str, Any]:
        """What is known of source and measurement, for the page."""
        ...
