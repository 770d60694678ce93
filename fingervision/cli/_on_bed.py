"""Options shared by all commands that use the test bed."""

from collections.abc import Callable
from typing import Any

import click

Command = Callable[..., Any]


def bed_option(command: Command) -> Command:
    """Add `--bed`: the word "simulated", or the configuration file of a test bed."""
    return click.option(
        "--bed", "bed_name", default="simulated", show_default=True, metavar="simulated|CONFIG.toml",
        help="The test bed: the word simulated, or its configuration file (bed.toml, see File formats in the manual).",
    )(command)  # fmt: skip


def hide_option(command: Command) -> Command:
    """Add `--hide`: effects that are injected into the simulated parts of the test bed."""
    return click.option(
        "--hide", multiple=True, metavar="EFFECT[:PARAMETER=VALUE,...]|SEALED.toml",
        help="Hide an effect of the catalogue in the simulated parts: measurement and diagnosis do not know it; "
            "repeatable.",
    )(command)  # fmt: skip
