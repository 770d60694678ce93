"""The examples of a Markdown page, taken out of it and run as a reader would."""

import contextlib
import io
import os
import re
import shlex
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click

from fingervision import effects
from fingervision.cli import cli
from fingervision.domain.errors import FingervisionError

FENCE = re.compile(
    r"^(?: *<!-- (?P<remark>[^\n]*?) -->\n+)?"
    r"(?P<indent> *)```(?P<language>[\w{}-]*)[^\n]*\n(?P<body>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)
NOT_RUN = "not run: "
"""Opens the remark above a block that no machine without the named thing can run: its options are checked instead."""

# What sets a machine up; installing is held by test_distribution, and the test commands by whoever reads this.
SET_UP = ("python3 -m venv", "python -m venv", "pip install", "pytest", "python -m build", "sphinx-build")


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block of a page.

    Parameters
    ----------
    page : str
        The page, from the top of the repository.
    line : int
        Line of the fence, from 1.
    language : str
        The word after the fence.
    remark : str
        What an HTML comment just above says; empty without one.
    body : str
        What is between the fences.
    shown : str
        The `text` block that follows at once: what the example prints; empty without one.
    """

    page: str
    line: int
    language: str
    remark: str
    body: str
    shown: str = ""

    @property
    def is_run(self) -> bool:
        """Whether the example is run, and not only its options checked."""
        return not self.remark.startswith(NOT_RUN)

    @property
    def place(self) -> str:
        """Page and line, for a message."""
        return f"{self.page}:{self.line}"


def blocks_of(path: Path, root: Path) -> list[Block]:
    """List the fenced blocks of a page in their order."""
    text = path.read_text(encoding="utf-8")
    matches = list(FENCE.finditer(text))
    found = []
    for number, match in enumerate(matches):
        after = matches[number + 1] if number + 1 < len(matches) else None
        follows = after is not None and after["language"] == "text" and not text[match.end() : after.start()].strip()
        found.append(
            Block(
                path.relative_to(root).as_posix(),
                text.count("\n", 0, match.start("indent")) + 1,
                match["language"],
                match["remark"] or "",
                match["body"],
                after["body"] if follows and after is not None and not after["remark"] else "",
            )
        )
    return found


@contextlib.contextmanager
def python_session() -> Iterator[None]:
    """Let the effects that Python blocks register with `@fv.effect` end with the page, as a reader's session does."""
    before = set(effects.catalogue())
    try:
        yield
    finally:
        for name in set(effects.catalogue()) - before:
            effects.withdraw(name)


def commands_of(block: Block) -> list[str]:
    """List the commands of a shell block, those joined by && apart, without comments and without the environment."""
    lines = block.body.replace("\\\n", " ").splitlines()
    parts = [part.strip() for line in lines if not line.strip().startswith("#") for part in line.split("&&")]
    return [part.replace(".venv/bin/", "") for part in parts if part]


def run_block(block: Block, names: dict[str, object], printed: dict[str, str]) -> str:
    """Run a block in the current folder and return what it prints.

    Parameters
    ----------
    block : Block
        Of `sh`, `python` or `toml`.
    names : dict
        Names that Python blocks of the page share.
    printed : dict
        What commands printed that were run in this folder before; they are not run again. Grows.
    """
    # A file that the page has its reader save: its name is the first comment.
    written = re.match(r"# (?P<name>[\w./-]+\.(?:py|toml))\n", block.body)
    if written:
        Path(written["name"]).parent.mkdir(parents=True, exist_ok=True)
        Path(written["name"]).write_text(block.body, encoding="utf-8")
    if block.language == "python":
        heard = io.StringIO()
        with contextlib.redirect_stdout(heard):
            exec(compile(block.body, block.place, "exec"), names)
        return heard.getvalue()
    if block.language == "sh":
        for command in commands_of(block):
            if command not in printed and not command.startswith(SET_UP):
                printed[command] = run_command(command)
        return "".join(printed.get(command, "") for command in commands_of(block))
    return ""


def run_command(line: str) -> str:
    """Run one command line; fingervision's in this process, since its imports and compiled loops cost seconds."""
    words = shlex.split(line)
    if Path(words[0]).name != "fingervision":
        done = subprocess.run(line, shell=True, capture_output=True, text=True, check=False, env=dict(os.environ))
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        return done.stdout
    heard, complained = io.StringIO(), io.StringIO()
    code = 0
    with contextlib.redirect_stdout(heard), contextlib.redirect_stderr(complained):
        try:
            cli.main(words[1:], prog_name="fingervision", standalone_mode=True)
        except SystemExit as end:
            code = int(end.code or 0)
        except FingervisionError as error:
            complained.write(f"fingervision: {error}\n")
            code = int(error.exit_code)
    assert code == 0, f"{line}\nended with {code}\n{heard.getvalue()}{complained.getvalue()}"
    return heard.getvalue()


def check_options(line: str) -> None:
    """Check a command line that cannot be run here: the command exists, and so does every option."""
    words = shlex.split(line)
    if Path(words[0]).name != "fingervision":
        return
    command: click.Command = cli
    path = []
    rest = words[1:]
    while isinstance(command, click.Group) and rest and not rest[0].startswith("-"):
        inner = command.get_command(click.Context(command), rest[0])
        assert inner is not None, f"{line}: no command {rest[0]}"
        path.append(rest.pop(0))
        command = inner
    known = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    for word in rest:
        option = word.split("=")[0]
        if re.fullmatch(r"-[a-zA-Z]|--[a-z][a-z-]*", option):
            assert option in known | {"--help", "-h", "--version"}, f"{line}: {' '.join(path)} has no {option}"


def agrees(shown: str, printed: str) -> bool:
    """Whether a page shows what is printed; `...` stands for anything, and spaces count as one."""
    pattern = re.escape(" ".join(shown.split())).replace(re.escape("..."), ".*?")
    return re.search(pattern, " ".join(printed.split())) is not None
