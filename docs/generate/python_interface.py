"""The reference of the Python interface: a page for every public name, from its docstring."""

import importlib
import inspect
from pathlib import Path
from types import ModuleType
from typing import Any

from sphinx.application import Sphinx
from sphinx.ext.napoleon.docstring import NumpyDocstring

import calib
import fingervision

FOR_AUTHORS = {
    "fingervision.testbed.actuator": ("Actuator", "MoveCheck", "StageLimits", "Alarm"),
    "fingervision.storage.toml_section": ("Section",),
    "fingervision.testbed.build_context": ("BuildContext",),
    "fingervision.testbed.clocks.clock": ("Clock",),
    "fingervision.testbed.motion.move_limits": ("SoftLimits", "check_move", "check_speed"),
    "fingervision.testbed.camera": ("BedCamera", "Shot", "Latency"),
    "fingervision.testbed.force_sensor": ("ForceSensor", "Reading"),
    "fingervision.domain.effect": ("DriveEffect", "PointEffect", "History", "Stage"),
    "fingervision.domain.response": ("Response",),
    "fingervision.domain.drawing_form": ("DrawingForm",),
}
"""What the author of a device or an effect imports beside `fingervision` itself, by module."""
PAGES = "python"
"""Folder of the pages, beside the page that lists them."""


def python_page(folder: Path) -> str:
    """Write a page for each public name into a folder, and return the lists of them."""
    folder.mkdir(exist_ok=True)
    testing = importlib.import_module("fingervision.testing")
    sections = {
        "Functions": [(fingervision, name) for name in fingervision.__all__ if name.islower() and name[0] != "_"],
        "Results and records": [(fingervision, name) for name in _classes(fingervision, errors=False)],
        "Errors": [(fingervision, name) for name in _classes(fingervision, errors=True)],
        "Every name of calib": [(calib, name) for name in calib.__all__],
        "For authors of devices and effects": [
            (importlib.import_module(path), name) for path, names in FOR_AUTHORS.items() for name in names
        ],
        "fingervision.testing, the contract tests": [(testing, name) for name in testing.__all__],
    }
    return "\n".join(_section(title, things, folder) for title, things in sections.items())


def _classes(module: ModuleType, *, errors: bool) -> list[str]:
    names = (name for name in module.__all__ if not name.islower())
    return [name for name in names if issubclass(getattr(module, name), Exception) is errors]


def _section(title: str, things: list[tuple[ModuleType, str]], folder: Path) -> str:
    rows, pages = [], []
    for module, name in things:
        path = f"{module.__name__}.{name}"
        # On some file systems, `fingervision.Batch` and `fingervision.batch` are one name.
        page = f"{path}-{'class' if inspect.isclass(getattr(module, name)) else 'use'}"
        (folder / f"{page}.md").write_text(
            f"# {name}\n\n```{{eval-rst}}\n{_entry(module, name)}\n```\n", encoding="utf-8"
        )
        rows.append(f"| [`{path}`]({PAGES}/{page}.md) | {_first_sentence(getattr(module, name))} |")
        pages.append(f"{PAGES}/{page}")
    tree = "\n".join(["```{toctree}", ":hidden:", "", *pages, "```"])
    return "\n".join([f"### {title}", "", "| name | what it is |", "|---|---|", *rows, "", tree, ""])


def _first_sentence(thing: Any) -> str:
    words = " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())
    return words.replace("|", "\\|")


def _entry(module: ModuleType, name: str) -> str:
    thing = getattr(module, name)
    path = f"{module.__name__}.{name}"
    if inspect.isclass(thing):
        kind = "autoexception" if issubclass(thing, Exception) else "autoclass"
        # What a protocol takes over from another one is asked of a device as well.
        taken_over = "\n   :inherited-members: Protocol" if getattr(thing, "_is_protocol", False) else ""
        return f".. {kind}:: {path}\n   :members:{taken_over}"
    if inspect.ismodule(thing) and hasattr(thing, "measure"):
        return "\n\n".join(f".. autofunction:: {path}.{each}" for each in thing.__all__)
    if not inspect.ismodule(thing):
        return f".. autofunction:: {path}"
    # The catalogue of effects is a package with a type of its own.
    kept = inspect.cleandoc(type(thing).__doc__ or "").replace("\n", "\n   ")
    return f".. py:data:: {path}\n\n   {kept}"


def plain_property(app: Sphinx, what: str, name: str, thing: object, options: Any, lines: list[str]) -> None:
    """Undo that the text of a property before its first colon is taken for its type."""
    if what == "property" and (words := inspect.getdoc(thing)):
        lines[:] = NumpyDocstring(words, app.config, app, "method", name, thing, options).lines()
