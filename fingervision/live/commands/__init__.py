"""What the page may ask for, a concern a file: each request is checked, done, and answered with a sentence."""

import importlib
import pkgutil
from functools import cache
from types import ModuleType
from typing import Any

from fingervision.domain.errors import UsageError
from fingervision.live.commands.asking import Answer, Command, Request, shown
from fingervision.live.view import View

__all__ = ["Answer", "Request", "harmless", "modules", "obey", "section"]


@cache
def modules() -> tuple[ModuleType, ...]:
    """Files of this package that have `COMMANDS`: adding one adds requests, and touches no other file.

    A file may also have `HARMLESS`, the names of its requests that change nothing and that a viewer may make, and
    `section(view)`, which gives what it adds to the state that every page is told.
    """
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = (importlib.import_module(f"{__name__}.{name}") for name in names)
    return tuple(module for module in found if hasattr(module, "COMMANDS"))


@cache
def _table() -> dict[str, Command]:
    return {name: command for module in modules() for name, command in module.COMMANDS.items()}


@cache
def harmless() -> frozenset[str]:
    """Names of the requests that change nothing."""
    return frozenset().union(*(getattr(module, "HARMLESS", frozenset()) for module in modules()))


def obey(view: View, request: Request) -> Answer:
    """Do what the page asks.

    Raises
    ------
    FingervisionError
        It cannot be done, or is nothing that can be asked.
    """
    name = request.get("do")
    command = _table().get(name) if isinstance(name, str) else None
    if command is None:
        raise UsageError(f"The page may ask for {', '.join(sorted(_table()))}, but asked for {shown(name)}.")
    return command(view, request)


def section(view: View) -> dict[str, Any]:
    """What the concerns add to the state that the page is told."""
    told: dict[str, Any] = {}
    for module in modules():
        if hasattr(module, "section"):
            told |= module.section(view)
    return told
