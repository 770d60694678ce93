"""The first Ctrl-C is recorded, the second is raised, and afterwards the signal handlers are restored."""

import signal
import threading

import pytest

from fingervision.measuring.frame_loop import asked_to_stop


def test_the_first_is_noted_and_the_second_raised() -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with asked_to_stop() as asked:
            signal.raise_signal(signal.SIGINT)
            assert asked.is_set()
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_worker_that_leaves_it_to_its_parent_notes_nothing() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with asked_to_stop() as asked:
            signal.raise_signal(signal.SIGINT)
        assert not asked.is_set()
    finally:
        signal.signal(signal.SIGINT, before)


def test_another_thread_than_the_main_one_is_left_alone() -> None:
    seen: list[bool] = []

    def other() -> None:
        with asked_to_stop() as asked:
            seen.append(asked.is_set())

    thread = threading.Thread(target=other)
    thread.start()
    thread.join()
    assert seen == [False]
