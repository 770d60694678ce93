"""The page's files, one script a concern; a file panel_NAME.js is a panel, loaded without being named anywhere."""

from functools import cache
from pathlib import Path

PAGE = Path(__file__).parent / "page"
SCRIPTS = "<!-- scripts -->"
LAST = "live.js"


@cache
def files() -> frozenset[str]:
    """Names that are served; whatever else is asked for is not there."""
    return frozenset(path.name for path in PAGE.iterdir() if path.is_file() and path.name != "index.html")


@cache
def index() -> str:
    """The page, with its panels' scripts in it and the one last that begins."""
    panels = sorted(name for name in files() if name.startswith("panel_") and name.endswith(".js"))
    tags = "\n".join(f'<script type="module" src="/page/{name}"></script>' for name in (*panels, LAST))
    return (PAGE / "index.html").read_text(encoding="utf-8").replace(SCRIPTS, tags)
