"""The reference of the Python interface: every public name, from its docstring."""

import inspect
from types import ModuleType

import calib
import fingervision


def python_page() -> str:
    """Write a section for each package, and in it an entry for each name of its `__all__`."""
    return "\n\n".join((_section(fingervision, "fingervision"), _section(calib, "calib"))) + "\n"


def _section(module: ModuleType, title: str) -> str:
    names = [name for name in module.__all__ if not name.startswith("__")]
    entries = "\n\n".join(_entry(module, name) for name in names)
    return f"## Every name of {title}\n\n```{{eval-rst}}\n{entries}\n```"


def _entry(module: ModuleType, name: str) -> str:
    thing = getattr(module, name)
    path = f"{module.__name__}.{name}"
    if inspect.isclass(thing):
        kind = "autoexception" if issubclass(thing, Exception) else "autoclass"
        return f".. {kind}:: {path}\n   :members:"
    if inspect.isfunction(thing):
        return f".. autofunction:: {path}"
    # What is no class and no function has the docstring of its type.
    words = " ".join((inspect.getdoc(type(thing)) or "").split("\n\n")[0].split())
    return f".. py:data:: {path}\n\n   {words}"
