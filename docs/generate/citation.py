"""How to cite the program, in words and as BibTeX, from CITATION.cff; the addresses are those of pyproject.toml."""

import tomllib
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
ADDRESSES = ("Repository", "Homepage", "Documentation")
"""Keys of `[project.urls]`; the first one that is filled in is cited."""


def citation_page() -> str:
    """Write the citation of the program and of the paper that it comes from."""
    about = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    urls = project.get("urls", {})
    url = next((urls[key] for key in ADDRESSES if urls.get(key)), "")
    return "\n\n".join(
        [
            "## The program",
            _words(about, url),
            _bibtex("misc", f"fingervision_{about['version']}", {**_of_software(about), "url": url}),
            "## The paper that it comes from",
            *(f"{_article_words(one)}\n\n{_bibtex('article', *_of_article(one))}" for one in about["references"]),
            "## The same for programs that read CITATION.cff",
            f"```yaml\n{(ROOT / 'CITATION.cff').read_text(encoding='utf-8').strip()}\n```\n",
        ]
    )


def _words(about: dict[str, Any], url: str) -> str:
    doi = f" <https://doi.org/{about['doi']}>" if "doi" in about else f" <{url}>" if url else ""
    year = about["date-released"].year
    return (
        f"{_names(about['authors'])} ({year}). *{about['title']}* (version {about['version']}) [Computer software]. "
        f"Licence {about['license']}.{doi}"
    )


def _article_words(one: dict[str, Any]) -> str:
    return (
        f"{_names(one['authors'])} ({one['year']}). {one['title']}. *{one['journal']}*, {one['volume']}"
        f"({one['issue']}), {one['start']}\u2013{one['end']}. <{one['url']}>"
    )


def _of_software(about: dict[str, Any]) -> dict[str, str]:
    return {
        "author": _bibtex_names(about["authors"]),
        "title": f"{{{about['title']}}}",
        "version": str(about["version"]),
        "date": str(about["date-released"]),
        "year": str(about["date-released"].year),
        "note": f"Version {about['version']}, {about['license']}",
        "doi": about.get("doi", ""),
    }


def _of_article(one: dict[str, Any]) -> tuple[str, dict[str, str]]:
    fields = {
        "author": _bibtex_names(one["authors"]),
        "title": f"{{{one['title']}}}".replace("\u2013", "--"),
        "journal": one["journal"],
        "volume": str(one["volume"]),
        "number": str(one["issue"]),
        "pages": f"{one['start']}--{one['end']}",
        "year": str(one["year"]),
        "url": one["url"],
    }
    return f"{one['authors'][0]['family-names']}{one['year']}", fields


def _names(authors: list[dict[str, str]]) -> str:
    named = [one["name"] if "name" in one else f"{one['family-names']}, {one['given-names'][0]}." for one in authors]
    return ", & ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)


def _bibtex_names(authors: list[dict[str, str]]) -> str:
    # A group's name is one word to BibTeX.
    return " and ".join(
        f"{{{one['name']}}}" if "name" in one else f"{one['family-names']}, {one['given-names']}" for one in authors
    )


def _bibtex(kind: str, key: str, fields: dict[str, str]) -> str:
    lines = [f"  {name:<7} = {{{value}}}," for name, value in fields.items() if value]
    return "\n".join(["```bibtex", f"@{kind}{{{key},", *lines, "}", "```"])
