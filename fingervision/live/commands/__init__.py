"""Requests from the browser page: each request is checked, executed, and answered with a sentence."""

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
    """List the modules of this package that define `COMMANDS`; a new module adds requests without any other change.

    A module may also define `HARMLESS`, the names of requests that change nothing and are allowed for viewers, and
    `section(view)`, which returns the topic's part of the state sent to every page.
    """
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = (importlib.import_module(f"{__name__}.{name}") for name in names)
    return tuple(module for module in found if hasattr(module, "COMMANDS"))


@cache
def _table() -> dict[str, Command]:
    return {name: command for module in modules() for name, command in module.COMMANDS.items()}


@cache
def harmless() -> frozenset[str]:
    """Names of the requests that change nothing and that viewers may send."""
    return frozenset().union(*(getattr(module, "HARMLESS", frozenset()) for module in modules()))


def obey(view: View, request: Request) -> Answer:
    """Execute a request from the browser page.

    Raises
    ------
    UsageError
        The request is unknown, or cannot be carried out.
    """
    name = request.get("do")
    command = _table().get(name) if isinstance(name, str) else None
    if command is None:
        raise UsageError(
            f"A request of the browser page must be one of {', '.join(sorted(_table()))}, but is {shown(name)}."
        )
    return command(view, request)


def section(view: View) -> dict[str, Any]:
    """Return the part of the state that each command module shows on the browser page, in one mapping."""
    told: dict[str, Any] = {}
    for module in modules():
        if hasattr(module, "section"):
            told |= module.section(view)
    return told
