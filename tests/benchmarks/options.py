"""Options of a benchmark on the command line, from their default values."""

import argparse
from collections.abc import Sequence
from typing import Any


def options_of(about: str | None, given: Sequence[str] | None = None, /, **defaults: Any) -> argparse.Namespace:
    """Read options: each has the type of its default, False is a switch, and a dict has argparse's own settings."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in defaults.items():
        own = {"action": "store_true"} if default is False else {"type": type(default), "default": default}
        parser.add_argument(f"--{name.replace('_', '-')}", **(default if isinstance(default, dict) else own))
    return parser.parse_args(given)
