"""Requests of the page, one file per topic: each is checked, executed, and answered by a sentence."""

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
    """Modules of this package that have `COMMANDS`: a new file adds its requests, and no other file changes.

    A module may also have `HARMLESS`, the names of its requests that change nothing and are allowed to viewers, and
    `section(view)`, which returns its part of the state sent to every page.
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
    """Execute a request of the page.

    Raises
    ------
    UsageError
        The request is unknown, or cannot be carried out.
    """
    name = request.get("do")
    command = _table().get(name) if isinstance(name, str) else None
    if command is None:
        raise UsageError(f"The page may ask for {', '.join(sorted(_table()))}, but asked for {shown(name)}.")
    return command(view, request)


def section(view: View) -> dict[str, Any]:
    """State of all topics, for the page."""
    told: dict[str, Any] = {}
    for module in modules():
        if hasattr(module, "section"):
            told |= module.section(view)
    return told
