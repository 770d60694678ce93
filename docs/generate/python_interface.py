"""The reference of the Python interface: a page for every public name, from its docstring."""

import importlib
import inspect
import re
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
WHOLE_EXAMPLES = {
    "fingervision.testbed.": ("tutorials/own_stage.md", "Your own stage"),
    "fingervision.testing.": ("how_to/extend.md", "Extend it"),
    "fingervision.domain.": ("how_to/extend.md", "Extend it"),
    "fingervision.storage.": ("how_to/extend.md", "Extend it"),
}
"""Page that uses a name in a whole example, by the beginning of the name."""
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
    examples = _Examples(
        [(fingervision, name) for name in fingervision.__all__] + [(calib, name) for name in calib.__all__]
    )
    return "\n".join(_section(title, things, folder, examples) for title, things in sections.items())


class _Examples:
    """The examples of docstrings, and for a record without one the first that makes it or names it."""

    def __init__(self, things: list[tuple[ModuleType, str]]) -> None:
        self._held = [(f"{module.__name__}.{name}", getattr(module, name)) for module, name in things]

    def beside(self, thing: Any) -> str:
        """Text with the example of another page; empty if the object has an example of its own, or there is none."""
        if not inspect.isclass(thing) or _example(thing):
            return ""
        for path, other in self._held:
            makes = getattr(other, "__annotations__", {}).get("return") in (thing, thing.__name__)
            if makes and _example(other):
                return _quoted(path, _example(other))
        for path, other in self._held:
            if re.search(rf"\b{thing.__name__}\b", _example(other)):
                return _quoted(path, _example(other))
        kind = fingervision.FingervisionError
        return _quoted("fingervision.FingervisionError", _example(kind)) if issubclass(thing, kind) else ""


def _example(thing: Any) -> str:
    """Text of the section Examples of a docstring, which is the last section."""
    _, _, found = (inspect.getdoc(thing) or "").partition("\nExamples\n--------\n")
    return found


def _quoted(path: str, example: str) -> str:
    return f".. rubric:: Example of :py:obj:`{path}`\n\n{example}\n"


def _classes(module: ModuleType, *, errors: bool) -> list[str]:
    names = (name for name in module.__all__ if not name.islower())
    return [name for name in names if issubclass(getattr(module, name), Exception) is errors]


def _section(title: str, things: list[tuple[ModuleType, str]], folder: Path, examples: _Examples) -> str:
    rows, pages = [], []
    for module, name in things:
        path = f"{module.__name__}.{name}"
        # On some file systems, `fingervision.Batch` and `fingervision.batch` are one name.
        page = f"{path}-{'class' if inspect.isclass(getattr(module, name)) else 'use'}"
        (folder / f"{page}.md").write_text(
            f"# {name}\n\n```{{eval-rst}}\n{_entry(module, name)}\n\n{examples.beside(getattr(module, name))}```\n"
            f"{_whole_example(path)}",
            encoding="utf-8",
        )
        rows.append(f"| [`{path}`]({PAGES}/{page}.md) | {_first_sentence(getattr(module, name))} |")
        pages.append(f"{PAGES}/{page}")
    tree = "\n".join(["```{toctree}", ":hidden:", "", *pages, "```"])
    return "\n".join([f"### {title}", "", "| name | what it is |", "|---|---|", *rows, "", tree, ""])


def _whole_example(path: str) -> str:
    """Sentence that says where what an author of devices or effects needs stands in a whole example."""
    for begin, (page, words) in WHOLE_EXAMPLES.items():
        if path.startswith(begin):
            return f"\nA whole example: [{words}](../../{page}).\n"
    return ""


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
