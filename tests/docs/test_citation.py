"""The page on citing says what CITATION.cff says, and the distribution names the same authors."""

import importlib
import re
import tomllib
from pathlib import Path

import pytest

from fingervision import __version__

ROOT = Path(__file__).parents[2]
CITATION = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_bibtex_entries_are_those_of_the_citation_file(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("yaml")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    page = importlib.import_module("generate.citation").citation_page()
    software, paper = re.findall(r"```bibtex\n@\w+\{(.*?)\n\}\n```", page, re.DOTALL)
    fields = dict(re.findall(r"^  (\w+) += \{(.*)\},$", software, re.MULTILINE))
    assert fields["version"] == __version__
    assert fields["author"] == "{The fingervision contributors}"
    assert f'title: "{fields["title"].strip("{}")}"' in CITATION
    assert fields["year"] == re.search(r"^date-released: (\d{4})", CITATION, re.MULTILINE)[1]  # type: ignore[index]
    assert "author  = {Hricko, Jaroslav and Havlik, Stefan}" in paper
    assert "pages   = {201--206}" in paper
    # Every brace that opens closes.
    assert all(entry.count("{") == entry.count("}") for entry in (software, paper))


def test_the_distribution_names_the_authors_and_the_licence_of_the_citation_file() -> None:
    assert re.findall(r"^  - name: \"(.*)\"$", CITATION, re.MULTILINE) == [one["name"] for one in PROJECT["authors"]]
    assert f"\nlicense: {PROJECT['license']}\n" in CITATION
