"""Headings, verdicts and errors are bold or coloured on a terminal, and nowhere else."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a pseudo-terminal is needed")
BOLD = "\x1b[1m"


def shown(arguments: list[str], **environment: str) -> str:
    """What a command prints on a terminal."""
    given = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
    parent, child = os.openpty()
    run = subprocess.Popen(
        [sys.executable, "-m", "fingervision", *arguments],
        stdin=subprocess.DEVNULL, stdout=child, stderr=child, env=given | {"TERM": "xterm"} | environment,
    )  # fmt: skip
    os.close(child)
    parts = []
    try:
        while part := os.read(parent, 4096):
            parts.append(part)
    except OSError:  # the other end is closed
        pass
    run.wait()
    os.close(parent)
    return b"".join(parts).decode()


@pytest.mark.parametrize(
    ("arguments", "words"), [(["diagnose", "--help"], "Model:"), (["effects", "nothing"], "fingervision:")]
)
def test_a_terminal_gets_bold_words_unless_the_user_wants_none(arguments: list[str], words: str) -> None:
    plain = {each: shown(arguments, **{each: value}) for each, value in (("NO_COLOR", "1"), ("TERM", "dumb"))}
    with_colours = shown(arguments)
    assert BOLD in with_colours
    for each in plain.values():
        assert words in each
        assert "\x1b" not in each
        assert with_colours.replace(BOLD, "").replace("\x1b[0m", "").replace("\x1b[31m", "") == each
