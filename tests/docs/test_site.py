"""The manual builds without a warning, leads nowhere that is not there, and asks nothing of a network."""

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


class References(HTMLParser):
    """What a page refers to, what it has names for, and what a browser would load with it."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.names: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.names |= {given[key] for key in ("id", "name") if key in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag in ("script", "img", "source", "iframe") and "src" in given:
            self.loaded.append(given["src"])
        if tag == "link" and given.get("rel", "") in ("stylesheet", "preload", "icon"):
            self.loaded.append(given.get("href", ""))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    build = pytest.importorskip("sphinx.cmd.build")
    for name in ("myst_parser", "furo", "latex2mathml", "sphinx_gallery"):
        pytest.importorskip(name)
    out = tmp_path_factory.mktemp("site")
    # -W: a warning is an error, among them links to headings, pages and files that are not there.
    assert build.main(["-W", "--keep-going", "-q", "-b", "html", "-d", str(out / "trees"), str(DOCS), str(out)]) == 0
    return out


def pages_of(site: Path) -> dict[Path, References]:
    found = {}
    for path in site.rglob("*.html"):
        found[path] = References()
        found[path].feed(path.read_text(encoding="utf-8"))
    return found


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # Sphinx and its themes warn of themselves; the pages' warnings are held by -W
def test_site_builds_has_no_dead_link_and_loads_nothing_from_elsewhere(site: Path) -> None:
    pages = pages_of(site)
    assert len(pages) > 20
    dead, foreign = [], []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists() or (
                parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].names
            ):
                dead.append(f"{path.name}: {link}")
        foreign += [f"{path.name}: {name}" for name in page.loaded if urlsplit(name).netloc]
    assert not dead
    assert not foreign
    for sheet in site.rglob("*.css"):
        fetched = re.findall(r"url\(\s*['\"]?(?:https?:)?//[^)]*\)", sheet.read_text(encoding="utf-8"))
        assert not fetched, f"{sheet.name} fetches {fetched}"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_formulas_are_mathml_and_generated_pages_are_whole(site: Path) -> None:
    from fingervision.effects import catalogue

    uncertainty = (site / "explanation" / "uncertainty.html").read_text(encoding="utf-8")
    assert "<math" in uncertainty
    assert "mathjax.js" not in uncertainty.lower()
    effects = (site / "reference" / "effects.html").read_text(encoding="utf-8")
    for name in catalogue():
        assert f'id="{name.replace("_", "-")}"' in effects
        assert f"{name}.svg" in effects
    assert "--px-per-mm" in (site / "reference" / "commands.html").read_text(encoding="utf-8")


MARKDOWN = [
    *(path for path in DOCS.rglob("*.md") if not {"_build", "_generated"} & set(path.relative_to(DOCS).parts)),
    *(ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")),
    *(path for top in ("fingervision", "calib", "tests", "sample_frames") for path in (ROOT / top).rglob("*.md")),
]


@pytest.mark.parametrize("path", MARKDOWN, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_between_files_lead_somewhere_where_code_is_hosted(path: Path) -> None:
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    dead = []
    for link in re.findall(r"\]\(([^()\s]+)\)", text):
        parts = urlsplit(link)
        if not parts.scheme and parts.path and "_generated" not in parts.path:
            target = (path.parent / unquote(parts.path)).resolve()
            # The site holds the pages of docs/ alone; a page names other files and does not link to them.
            if not target.exists() or (DOCS in path.parents and target.suffix == ".md" and DOCS not in target.parents):
                dead.append(link)
            elif parts.fragment and target.suffix == ".md":
                anchors = {
                    _anchor(h) for h in re.findall(r"^#+ (.+)$", target.read_text(encoding="utf-8"), re.MULTILINE)
                }
                labels = set(re.findall(r"^\(([\w-]+)\)=$", target.read_text(encoding="utf-8"), re.MULTILINE))
                if parts.fragment not in anchors | labels:
                    dead.append(link)
    assert not dead


def _anchor(heading: str) -> str:
    """Anchor of a heading as code hosts make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
