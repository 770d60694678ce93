"""Form of a command: help in named groups with nothing cut, colours, former spellings of options, types of values."""

import os
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click

from fingervision.domain.errors import ArgumentError, UsageError
from fingervision.domain.numbers import stated_number

Function = Callable[..., Any]

SCALE = "Scale"
MEASURED = "What is measured"
MODEL = "Model"
CLOCK = "Clock and drive"
TABLES = "Tables"
CAMERA = "Camera"
BED = "Test bed"
PAGE = "Browser page"
OUTPUT = "Output"
OTHER = "Options"
LAST = (OUTPUT, OTHER)
"""Groups that stand at the end of every help."""
WHOLE = 10_000
"""More letters than the first sentence of any command has, so that the list of commands cuts none."""


COLOUR = False if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb" else None
"""Whether words may be bold or coloured (https://no-color.org); None asks whether the output is a terminal."""


def complain(words: str) -> None:
    """Print an error, after the name of the program."""
    click.echo(f"{click.style('fingervision:', fg='red', bold=True)} {words}", err=True, color=COLOUR)


class _Formatter(click.HelpFormatter):
    def write_heading(self, heading: str) -> None:
        super().write_heading(click.style(heading, bold=True))


class _Context(click.Context):
    formatter_class = _Formatter


class Option(click.Option):
    """An option that stands in a group of the help, and keeps spellings that it had in an earlier version.

    Parameters
    ----------
    group : str
        Heading in the help.
    former : sequence of str
        Spellings that are accepted, but not shown.
    """

    def __init__(self, *declared: Any, group: str = OTHER, former: Sequence[str] = (), **settings: Any) -> None:
        super().__init__(*declared, **settings)
        self.group, self.former = group, tuple(former)

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        """Let the parser accept the former spellings too."""
        shown, self.opts = self.opts, [*self.opts, *self.former]
        super().add_to_parser(parser, ctx)
        self.opts = shown


class Command(click.Command):
    """A command whose help lists the options in their groups."""

    context_class = _Context

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write one section for every group."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for each in self.get_params(ctx):
            if isinstance(each, click.Option) and (record := each.get_help_record(ctx)) is not None:
                groups.setdefault(getattr(each, "group", OTHER), []).append(record)
        for name in [*(name for name in groups if name not in LAST), *(name for name in LAST if name in groups)]:
            with formatter.section(name):
                formatter.write_dl(groups[name])


class Group(click.Group, Command):
    """A command with subcommands, of which the help tells the whole first sentence.

    Parameters
    ----------
    kinds : str
        The subcommands, each with what it is for; by default only their names.
    """

    command_class = Command

    def __init__(self, *given: Any, kinds: str = "", **settings: Any) -> None:
        super().__init__(*given, **settings)
        self._kinds = kinds

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Say for a name that does not exist which is the nearest, or which there are and what each is for."""
        known = self.list_commands(ctx)
        if args[0] not in known and not args[0].startswith("-"):
            if near := get_close_matches(args[0], known, n=1):
                ctx.fail(f"No such command '{args[0]}'. Did you mean '{near[0]}'?")
            kinds = self._kinds or f"{', '.join(known[:-1])} or {known[-1]}"
            raise UsageError(
                f"{ctx.command_path} must be followed by {kinds}, but is followed by {args[0]}: see {ctx.command_path} "
                "--help."
            )
        return super().resolve_command(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the subcommands, in the order of their definition."""
        return list(self.commands)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, then the subcommands."""
        Command.format_options(self, ctx, formatter)
        self.format_commands(ctx, formatter)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the first sentence of every subcommand."""
        listed = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, each.get_short_help_str(WHOLE)) for name, each in listed if each is not None])


class FileName(click.Path):
    """Name of a file or folder; the command that opens it says what is wrong with it."""

    def __init__(self, word: str = "file") -> None:
        super().__init__(path_type=Path)
        self.name = word


class ModelFile(FileName):
    """Name of a model's file; `model.py:simulate` means the file model.py."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path of the model's file."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if ".py:" not in path.name:
            return path
        from fingervision.models.function_model import model_file

        return model_file(path)


class Number(click.types.FloatParamType):
    """A finite decimal number; a comma is understood where only one reading is possible.

    Parameters
    ----------
    above : float or None
        The number must be greater than this.
    """

    def __init__(self, above: float | None = None) -> None:
        self._above = above

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read the number; errors begin with the option as it was typed."""
        option = param.opts[0] if isinstance(param, click.Option) else str(param and param.human_readable_name)
        if isinstance(value, str):
            try:
                value = stated_number(value, option)
            except ArgumentError as error:
                raise UsageError(str(error)) from None
        if self._above is not None and not value > self._above:
            raise UsageError(f"{option} must be greater than {self._above:g}, but is {value:g}.")
        return float(value)


class KindName(click.ParamType):  # type: ignore[type-arg]  # generic in new versions of click alone
    """Name of a kind of model, built in or from a plug-in; only names are looked up, and no plug-in is imported.

    Parameters
    ----------
    also : str
        Additional accepted words, which denote several kinds (such as `all`).
    """

    name = "kind"

    def __init__(self, *also: str) -> None:
        self._also = also

    def _names(self) -> tuple[str, ...]:
        from fingervision.models.kind_names import kind_names

        return (*kind_names(), *self._also)

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Return the allowed names for the help text."""
        return f"[{'|'.join(self._names())}]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Refuse an unknown kind, naming the nearest known one."""
        names = self._names()
        if value not in names:
            near = get_close_matches(str(value), names, n=1)
            hint = f" Did you mean {near[0]}?" if near else ""
            self.fail(f"{value!r} is not one of {', '.join(map(repr, names))}.{hint}", param, ctx)
        return str(value)


FILE, FOLDER, MODEL_FILE, NUMBER = FileName(), FileName("folder"), ModelFile(), Number()


def make_command(epilog: str, **settings: Any) -> Callable[[Function], Command]:
    """Make a command of a function; `epilog` has its examples."""
    return click.command(cls=Command, epilog=epilog, **settings)


def option(*declared: str, **settings: Any) -> Callable[[Function], Function]:
    """Add an option in a group of the help; see `Option`."""
    return click.option(*declared, cls=Option, **settings)


def together(*options: Callable[[Function], Function]) -> Callable[[Function], Function]:
    """Join options that several commands share, in the order of the help."""

    def decorate(function: Function) -> Function:
        for each in reversed(options):
            function = each(function)
        return function

    return decorate
