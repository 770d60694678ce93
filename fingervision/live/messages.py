"""Messages for users of the live view: numbered, kept for some time, and sent to listeners at once."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

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
