"""The terminal: answers and letters come by one keyboard, and none is lost or taken for the other."""

import os
import pty
from collections.abc import Iterator
from io import StringIO
from threading import Event, Timer
from time import monotonic, sleep

import pytest

from fingervision.domain.errors import FingervisionError
from fingervision.testbed.terminal import Terminal

SOON_S = 10.0


@pytest.fixture
def keyboard() -> Iterator[tuple[int, Terminal, StringIO]]:
    """The typing end of a terminal, and what reads the other."""
    typing, reading = pty.openpty()
    screen = StringIO()
    with os.fdopen(reading, "r") as stream:
        yield typing, Terminal(stream, screen), screen
        os.write(typing, b"\x04")  # the end of input, so that the reader ends
        sleep(0.1)
    os.close(typing)


def test_a_line_is_an_answer_if_a_question_stands_and_a_letter_otherwise(
    keyboard: tuple[int, Terminal, StringIO],
) -> None:
    typing, terminal, screen = keyboard
    letters: list[str] = []
    with terminal.listening(letters.append, lambda: False):
        for number in range(3):
            os.write(typing, b"p\n")
            until_s = monotonic() + SOON_S
            while len(letters) <= number:
                assert monotonic() < until_s
                sleep(0.01)
            answer = _typed_when_asked(typing, terminal, f"{number}.5")
            assert answer == f"{number}.5\n"
    assert letters == ["p\n"] * 3
    assert screen.getvalue() == "How far? " * 3


def _typed_when_asked(typing: int, terminal: Terminal, words: str) -> str | None:
    timer = Timer(0.1, lambda: os.write(typing, f"{words}\n".encode()))
    timer.start()
    answer = terminal.ask("How far? ")
    timer.join()
    return answer


def test_a_stop_ends_the_waiting_for_an_answer(keyboard: tuple[int, Terminal, StringIO]) -> None:
    _, terminal, _ = keyboard
    stopped = Event()
    stopped.set()
    with (
        terminal.listening(lambda line: None, stopped.is_set),
        pytest.raises(FingervisionError, match=r"^The question was not answered, because the run was stopped\."),
    ):
        terminal.ask("How far? ")


def test_without_a_terminal_answers_are_read_as_they_come() -> None:
    terminal = Terminal(StringIO("1\n2\n"), StringIO())
    with terminal.listening(lambda line: None, lambda: False):
        assert [terminal.ask("?"), terminal.ask("?"), terminal.ask("?")] == ["1\n", "2\n", None]
