"""The reference of the commands: click's own help, option by option."""

import re
from collections.abc import Iterator

import click

from fingervision.cli import cli


def commands_page() -> str:
    """Write every command and subcommand as a section, in the order of `fingervision --help`."""
    return "\n\n".join(_sections(cli, ("fingervision",), 2)) + "\n"


def _sections(command: click.Command, path: tuple[str, ...], level: int) -> Iterator[str]:
    context = click.Context(command, info_name=" ".join(path))
    if len(path) > 1:
        yield f"{'#' * level} {' '.join(path)}"
        yield _text(command.help or command.short_help or "")
        yield f"```text\n{_usage(command, context)}\n```"
        yield from _options(command, context)
        if command.epilog:
            yield f"```text\n{_plain(command.epilog)}\n```"
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            assert inner is not None  # noqa: S101 - it was listed
            yield from _sections(inner, (*path, name), min(level + (len(path) > 1), 3))


def _usage(command: click.Command, context: click.Context) -> str:
    return " ".join([context.command_path, *command.collect_usage_pieces(context)])


def _options(command: click.Command, context: click.Context) -> Iterator[str]:
    records = [record for parameter in command.params if (record := parameter.get_help_record(context))]
    # The usage line names the arguments; a row without words would say nothing more.
    rows = [(names, words) for names, words in records if words.strip()]
    if rows:
        lines = [f"| `{_cell(names)}` | {_cell(words)} |" for names, words in rows]
        yield "\n".join(["| option | what it does |", "|---|---|", *lines])


def _cell(text: str) -> str:
    return _escaped(" ".join(text.split())).replace("|", "\\|")


def _escaped(text: str) -> str:
    return text.replace("<", "&lt;").replace("*", "\\*") if "`" not in text else text


def _text(text: str) -> str:
    paragraphs = re.split(r"\n\s*\n", _plain(text))
    return "\n\n".join(_escaped(" ".join(paragraph.split())) for paragraph in paragraphs)


def _plain(text: str) -> str:
    return "\n".join(line.rstrip() for line in text.replace("\b\n", "").replace("\b", "").strip("\n").splitlines())
