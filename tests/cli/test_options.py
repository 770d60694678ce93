"""The same option has the same word in every command; former spellings still work; the help cuts nothing."""

import click
import pytest
from click.shell_completion import ShellComplete

from fingervision.cli import COMMONEST, cli
from fingervision.cli._command import FileName, Option
from tests.cli.test_help_examples import commands

ALL = commands(cli)
OPTIONS = [(path, each) for path, command in ALL for each in command.params if isinstance(each, Option)]
FORMER = {
    "table": {"--as": "--kind", "--png": "--figure"},
    "inspect": {"--picture": "--figure", "--no-picture": "--no-figure"},
    "calibrate bar": {"--no-picture": "--no-figure"},
    "calibrate chessboard": {"--no-picture": "--no-figure"},
    "gauge": {"--no-browser": "--no-page"},
    "bed jog": {"--for-s": "--seconds"},
    "bed steps": {"--plot": "--figure"},
}


def test_every_option_of_a_command_stands_in_a_group() -> None:
    plain = [(path, each.name) for path, command in ALL for each in command.params if type(each) is click.Option]
    assert plain == []


@pytest.mark.parametrize("name", FORMER)
def test_former_spellings_are_read_and_not_shown(name: str) -> None:
    command = next(command for path, command in ALL if " ".join(path) == name)
    shown = command.get_help(click.Context(command)).split()
    by_word = {word: each for each in command.params if isinstance(each, Option) for word in each.opts}
    for former, word in FORMER[name].items():
        assert former in by_word[word].former
        assert former not in [each.rstrip(",") for each in shown]
        needed = [x for p in command.params if isinstance(p, click.Argument) for x in ["1"]]
        needed += ["--square-mm", "1", "--squares", "9x6"] if "chessboard" in name else []
        value = [] if by_word[word].is_flag else ["drive" if word == "--kind" else "2"]
        with command.make_context(name, [*needed, former, *value]) as context:
            source = context.get_parameter_source(str(by_word[word].name))
        assert source is click.core.ParameterSource.COMMANDLINE


def test_one_word_for_one_option() -> None:
    shown = {word for _, each in OPTIONS for word in each.opts}
    assert not shown & {word for _, each in OPTIONS for word in each.former}
    for _, each in OPTIONS:
        assert ("--out" in each.opts) == ("-o" in each.opts)
        if isinstance(each.type, click.Path):
            assert isinstance(each.type, FileName)


def test_the_commonest_commands_stand_first_and_no_sentence_is_cut() -> None:
    context = click.Context(cli, info_name="fingervision")
    listed = cli.list_commands(context)
    assert tuple(listed[: len(COMMONEST)]) == COMMONEST
    for path, command in ALL:
        assert "..." not in command.get_short_help_str(10_000)
        if isinstance(command, click.Group):
            words = " ".join(command.get_help(click.Context(command, info_name=path[-1])).split())
            assert "..." not in words.partition("Commands:")[2].partition("Examples:")[0]


@pytest.mark.parametrize("words", [["effects"], ["diagnose", "--with"], ["bed", "run", "--hide"]])
def test_names_of_effects_complete(words: list[str]) -> None:
    found = ShellComplete(cli, {}, "fingervision", "_FINGERVISION_COMPLETE").get_completions(words, "back")
    assert [each.value for each in found] == ["backlash"]
