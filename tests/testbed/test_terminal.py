"""The terminal: answers and command letters come from one keyboard; none is lost, and none is confused."""

import os
import pty
from collections.abc import Callable, Iterator
from io import StringIO
from threading import Event, Thread
from time import monotonic, sleep

import pytest

from fingervision.domain.errors import StateError
from fingervision.testbed.terminal import Terminal

SOON_S = 60.0
QUESTION = "How far? "


@pytest.fixture
def keyboard() -> Iterator[tuple[int, Terminal, StringIO]]:
    """The end of a terminal to which a test types, the terminal that reads the other end, and the screen."""
    typing, reading = pty.openpty()
    screen = StringIO()
    with os.fdopen(reading, "r") as stream:
        terminal = Terminal(stream, screen)
        yield typing, terminal, screen
        os.write(typing, b"\x04")  # end of input, so that the reading thread ends
        if terminal._reader is not None:
            terminal._reader.join()
    os.close(typing)


def test_a_line_is_an_answer_if_a_question_stands_and_a_letter_otherwise(
    keyboard: tuple[int, Terminal, StringIO],
) -> None:
    typing, terminal, screen = keyboard
    letters: list[str] = []
    with terminal.listening(letters.append, lambda: False):
        for number in range(3):
            os.write(typing, b"p\n")
            wait_until(lambda number=number: len(letters) > number)  # type: ignore[misc]
            answering = Thread(target=answer, args=(typing, screen, number))
            answering.start()
            assert terminal.ask(QUESTION) == f"{number}.5\n"
            answering.join()
    assert letters == ["p\n"] * 3
    assert screen.getvalue() == QUESTION * 3


def answer(typing: int, screen: StringIO, number: int) -> None:
    """Type an answer as soon as the question appears on the screen."""
    wait_until(lambda: screen.getvalue().count(QUESTION) > number)
    os.write(typing, f"{number}.5\n".encode())


def wait_until(holds: Callable[[], bool]) -> None:
    until_s = monotonic() + SOON_S
    while not holds():
        assert monotonic() < until_s
        sleep(0.001)


def test_a_stop_ends_the_waiting_for_an_answer(keyboard: tuple[int, Terminal, StringIO]) -> None:
    _, terminal, _ = keyboard
    stopped = Event()
    stopped.set()
    with (
        terminal.listening(lambda line: None, stopped.is_set),
        pytest.raises(StateError, match=r"^The operator gave no answer before the run was stopped\."),
    ):
        terminal.ask(QUESTION)


def test_without_a_terminal_answers_are_read_as_they_come() -> None:
    terminal = Terminal(StringIO("1\n2\n"), StringIO())
    with terminal.listening(lambda line: None, lambda: False):
        assert [terminal.ask("?"), terminal.ask("?"), terminal.ask("?")] == ["1\n", "2\n", None]
