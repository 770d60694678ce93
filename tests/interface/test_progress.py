"""Progress: a user's function, a bar on a terminal, nothing elsewhere."""

import io
import sys

import pytest

import fingervision as fv
from fingervision.interface.progress import shown


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_bar_counts_to_the_whole_on_a_terminal(monkeypatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    with shown(True, "Measuring", "frames") as show:
        for done in (2, 4):
            show(done, 4)
    assert "Measuring: 100%" in screen.getvalue()
    assert "4/4" in screen.getvalue()


def test_a_bar_of_a_share_ends_at_its_whole(monkeypatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    with shown(True, "Diagnosing") as show:
        show(0.5)
        show(1.0)
    assert "Diagnosing: 100%" in screen.getvalue()


def test_nothing_is_shown_where_nobody_looks_on(capsys) -> None:
    with shown(True, "Measuring", "frames") as show:
        assert show is None
    assert capsys.readouterr().err == ""


def test_a_function_is_called_itself() -> None:
    with shown(print, "Measuring") as show:
        assert show is print


def test_what_is_neither_is_refused() -> None:
    with pytest.raises(fv.ArgumentError, match=r"^progress must be a function or True"), shown("yes", "Measuring"):
        pass
