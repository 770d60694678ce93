"""Write the generated parts of the reference into `docs/_generated` before Sphinx reads the pages that include them."""

from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from generate.citation import citation_page
from generate.commands import commands_page
from generate.effects import effects_page
from generate.package_notes import NOTES, note
from generate.python_interface import PAGES, plain_property, python_page
from generate.recipe_kinds import recipe_kinds_page


def write_pages(app: Sphinx) -> None:
    """Write every generated page."""
    folder = Path(app.srcdir) / "_generated"
    folder.mkdir(exist_ok=True)
    (folder / "citation.md").write_text(citation_page(), encoding="utf-8")
    (folder / "commands.md").write_text(commands_page(), encoding="utf-8")
    (folder / "python.md").write_text(python_page(Path(app.srcdir) / "reference" / PAGES), encoding="utf-8")
    (folder / "recipe_kinds.md").write_text(recipe_kinds_page(), encoding="utf-8")
    (folder / "notes").mkdir(exist_ok=True)
    for name in NOTES:
        (folder / "notes" / f"{name}.md").write_text(note(name), encoding="utf-8")
    (folder / "effects.md").write_text(effects_page(folder / "effects"), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.connect("builder-inited", write_pages)
    app.connect("autodoc-process-docstring", plain_property, priority=600)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
