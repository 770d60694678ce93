"""Files of the browser page, one script per topic; every file panel_NAME.js is loaded as a panel automatically."""

from functools import cache
from pathlib import Path

PAGE = Path(__file__).parent / "page"
SCRIPTS = "<!-- scripts -->"
LAST = "live.js"


@cache
def files() -> frozenset[str]:
    """Names of the files that the server delivers; any other name gives the error "not found"."""
    return frozenset(path.name for path in PAGE.iterdir() if path.is_file() and path.name != "index.html")


@cache
def index() -> str:
    """HTML text of the page, with the scripts of its panels, and the start script last."""
    panels = sorted(name for name in files() if name.startswith("panel_") and name.endswith(".js"))
    tags = "\n".join(f'<script type="module" src="/page/{name}"></script>' for name in (*panels, LAST))
    return (PAGE / "index.html").read_text(encoding="utf-8").replace(SCRIPTS, tags)
