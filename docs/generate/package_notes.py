"""Notes on packages: the READMEs that the manual cites, as pages of the site."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
NOTES = {
    "models": "fingervision/models/README.md",
    "diagnosis": "fingervision/diagnosis/README.md",
    "tables": "fingervision/tables/README.md",
    "gauges": "fingervision/gauges/README.md",
    "testbed": "fingervision/testbed/README.md",
    "firmware": "fingervision/testbed/firmware/README.md",
    "hidden_effects": "tests/benchmarks/hidden/README.md",
    "foreign_laboratories": "tests/benchmarks/world/README.md",
}
"""File of the repository that each page of `docs/notes` repeats, by the page's name."""


def note(name: str) -> str:
    """Return the text of a README without its title, with its links to other READMEs turned to the site's pages."""
    path = ROOT / NOTES[name]
    _, _, text = path.read_text(encoding="utf-8").partition("\n")
    text = re.sub(r"\[([^\]]+)\]\(([^()\s:#]+)\)", lambda link: _on_the_site(path, link[1], link[2]), text)
    return _below_one_title(text)


def _below_one_title(text: str) -> str:
    """Turn further titles of a README into headings of the second level, because a page has one title."""
    parts = re.split(r"(```.*?```)", text, flags=re.DOTALL)  # code stands at the odd places, and stays
    parts[::2] = [re.sub(r"^# ", "## ", part, flags=re.MULTILINE) for part in parts[::2]]
    return "".join(parts)


def _on_the_site(path: Path, words: str, target: str) -> str:
    """Link to the page that repeats a file; the words alone if no page does."""
    file = (path.parent / target).resolve()
    pages = {(ROOT / source).resolve(): name for name, source in NOTES.items()}
    return f"[{words}]({pages[file]}.md)" if file in pages else words
