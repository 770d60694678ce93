"""Parts of a report's HTML page: tables, lists, machine-readable numbers, and charts that need no network."""

import math
from collections.abc import Sequence
from html import escape
from pathlib import Path

from fingervision.diagnosis.report.chart_data import Chart, charts_json
from fingervision.diagnosis.report.sentences import COVERAGE_FACTOR, limit_words
from fingervision.domain.parameter import Estimate
from fingervision.storage.provenance import Provenance

PAGE = Path(__file__).parent / "page"
# The chart library of the live page (uPlot, MIT licence) is used here too.
CHARTS = Path(__file__).parents[2] / "live" / "page"
HINT = "Drag to zoom, double-click to see all; with the keyboard: arrows read values, + and - zoom, 0 shows all."


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Table whose cells are already HTML; wide tables have their own scroll bar."""
    top = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll" tabindex="0" role="group"><table><tr>{top}</tr>{body}</table></div>'


def bullets(items: Sequence[str]) -> str:
    """HTML list of sentences; an empty list becomes a sentence that there are none."""
    return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>" if items else "<p>Nothing.</p>"


def number(value: float | None, unit: str = "mm", digits: int = 4) -> str:
    """HTML of a number: rounded for a reader, and with its full value for programs (the `data` element)."""
    if value is None:
        return "-"
    return f'<data value="{value!r}">{value:.{digits}g}</data> {escape(unit)}'.rstrip()


def named(name: str) -> str:
    """Write an identifier so that it may break at its underscores on a narrow screen."""
    return escape(name).replace("_", "_<wbr>")


def with_uncertainty(e: Estimate) -> list[str]:
    """Value and expanded uncertainty, rounded to a tenth of the standard uncertainty."""
    limit = limit_words(e)
    if limit:
        return [escape(limit), "limited on one side only"]
    if e.u is None:
        return [number(e.value, e.unit, 5), "at a bound"]
    places = max(0, 1 - math.floor(math.log10(e.u))) if e.u > 0.0 else 6
    value = f'<data value="{e.value!r}">{e.value:.{places}f}</data> {escape(e.unit)}'
    return [value, f"{COVERAGE_FACTOR * e.u:.{places}f} {escape(e.unit)}".rstrip()]


def chart(found: Chart, words: str) -> str:
    """HTML placeholder for a chart that the script draws, with a line below it for the value under the cursor."""
    name = escape(str(found["id"]), quote=True)
    note = f'<p class="hint">{escape(str(found["note"]))}.</p>' if found.get("note") else ""
    return (
        f'<div class="chart" id="{name}" tabindex="0" role="group" aria-label="{escape(words, quote=True)}. '
        f'{HINT}"></div><p class="readout" aria-live="polite"></p>{note}'
    )


def provenance_html(made: Provenance) -> str:
    """HTML with the files, the command and the versions from which a result was obtained."""
    files = table(
        ["used as", "file", "bytes", "SHA-256"],
        [
            [escape(f.role), escape(f.name), f"{f.size_bytes}", f"<code>{f.sha256}</code>"]
            for f in made.files
        ],
    )  # fmt: skip
    versions = ", ".join(f"{name} {version}" for name, version in made.versions.items())
    how = f"<p>Made {escape(made.made_at)} by <code>{escape(made.command)}</code> with {escape(versions)}.</p>"
    return f"{files}{how}<p>To cite: {escape(made.citation)}</p>"


def page(title: str, heading: str, verdict: str, sections: Sequence[tuple[str, str]], charts: list[Chart]) -> str:
    """Compose a whole HTML page that contains styles, charts and data, so that it opens without a network."""
    style = (CHARTS / "uPlot.min.css").read_text(encoding="utf-8") + (PAGE / "report.css").read_text(encoding="utf-8")
    library = (CHARTS / "uPlot.iife.min.js").read_text(encoding="utf-8")
    script = (PAGE / "charts.js").read_text(encoding="utf-8")
    body = "".join(f"<section><h2>{escape(name)}</h2>{content}</section>" for name, content in sections)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        # Without an icon, the browser would request one from a server.
        '<link rel="icon" href="data:,">'
        f"<title>{escape(title)}</title><style>{style}</style></head><body><main>"
        f'<h1>{escape(heading)}</h1><p class="verdict">{escape(verdict)}</p>{body}</main>'
        f'<script type="application/json" id="figures">{charts_json(charts)}</script>'
        f"<script>{library}</script><script>{script}</script></body></html>\n"
    )
