"""The option that adds user-defined effects to the catalogue for one command."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click

Command = Callable[..., Any]


def effects_option(command: Command) -> Command:
    """Add `--effects`: Python files whose effects are added to the catalogue while the command runs."""

    @wraps(command)
    def with_effects(*arguments: Any, effects_files: tuple[Path, ...], **options: Any) -> Any:
        if not effects_files:
            return command(*arguments, **options)
        from fingervision.effects import added_effects

        with added_effects(effects_files):
            return command(*arguments, **options)

    return click.option(
        "--effects", "effects_files", multiple=True, metavar="FILE.py", type=click.Path(path_type=Path),
        help="Add the effects of this Python file to the catalogue; repeatable.",
    )(with_effects)  # fmt: skip
