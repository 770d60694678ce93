"""Overview of all results: a table, a plot, and an HTML page with a small plot of each result."""

import hashlib
import html
import importlib
import pkgutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast
from urllib.parse import quote
from uuid import uuid4

import fingervision.batch
from fingervision.batch.result_folder import replace_text
from fingervision.batch.task import Cell, Digest, Outcome
from fingervision.storage.durable import replaced
from fingervision.storage.row_file import table_text as lines_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Summaries of the results of a command in a table, a plot and small plots, with one module per command.

PREFIX = "results_of_"


class Reduction(Protocol):
    """Protocol of a module `results_of_<command>`."""

    COLUMNS: tuple[str, ...]
    """Columns of the command's table, after the columns that every command has."""

    def digest_of(self, folder: Path) -> Digest:
        """Summarise one result folder."""
        ...

    def draw(self, figure: "Figure", outcomes: Sequence[Outcome]) -> None:
        """Draw the plot of all results."""
        ...


def reduction_of(command: str) -> Reduction:
    """Find the module that summarises the results of a command.

    Raises
    ------
    ModuleNotFoundError
        There is no module for this command.
    """
    return cast(Reduction, importlib.import_module(f"{fingervision.batch.__name__}.{PREFIX}{command}"))


def commands() -> tuple[str, ...]:
    """Names of the commands whose results a batch can summarise."""
    names = (module.name for module in pkgutil.iter_modules(fingervision.batch.__path__))
    return tuple(sorted(name.removeprefix(PREFIX) for name in names if name.startswith(PREFIX)))


# Small plot of a curve, embedded in the HTML page.


WIDTH_PX, HEIGHT_PX, MARGIN_PX = 156, 44, 2


def small_picture(curve: Sequence[float | None]) -> str:
    """Plot evenly spaced values as SVG, scaled to the range of the values; missing values leave gaps in the curve.

    Parameters
    ----------
    curve : sequence of float or None
        Values of the curve; None for a missing value.
    """
    there = [value for value in curve if value is not None]
    lines = ""
    if there:
        low, high = min(there), max(there)
        step_px = (WIDTH_PX - 2 * MARGIN_PX) / max(1, len(curve) - 1)
        scale_px = (HEIGHT_PX - 2 * MARGIN_PX) / (high - low) if high > low else 0.0
        middle_px = 0.0 if high > low else HEIGHT_PX / 2 - MARGIN_PX
        piece: list[str] = []
        for number, value in enumerate([*curve, None]):
            if value is not None:
                y_px = HEIGHT_PX - MARGIN_PX - middle_px - (value - low) * scale_px
                piece.append(f"{MARGIN_PX + number * step_px:.0f},{y_px:.1f}")
            elif piece:
                # A single point is drawn as a line of zero length, whose round ends make a dot.
                lines += f'<polyline points="{" ".join(piece * 2 if len(piece) == 1 else piece)}"/>'
                piece = []
    return (
        f'<svg width="{WIDTH_PX}" height="{HEIGHT_PX}" fill="none" stroke="#11507a" stroke-width="1.5" '
        f'stroke-linecap="round">{lines}</svg>'
    )


TABLE, FIGURE, PAGE = "batch.csv", "batch.png", "index.html"
FIRST_COLUMNS = ("input", "result", "exit_code", "words")
SIZE_INCHES, DOTS_PER_INCH = (10.0, 6.0), 110
STYLE = """
body{font:15px/1.4 system-ui,sans-serif;margin:1.5em;color:#222}img{max-width:100%}
.all{display:flex;flex-wrap:wrap;gap:10px}
.one{border:1px solid #ccc;border-radius:4px;padding:6px;width:170px;overflow-wrap:anywhere;font-size:12px;
content-visibility:auto;contain-intrinsic-size:170px 130px}
.bad{border-color:#c0392b}.bad p{color:#c0392b}.one p{margin:2px 0}a{color:#11507a}svg{display:block}
"""


def write_overview(out: Path, command: str, outcomes: Sequence[Outcome]) -> None:
    """Write batch.csv, batch.png and index.html, unless they exist with the same content.

    Raises
    ------
    OSError
        The overview files cannot be written; the earlier ones are kept.
    """
    reduction = reduction_of(command)
    table = table_text(out, reduction, outcomes)
    stamp = f"<!-- {hashlib.sha256(table.encode('utf-8', 'surrogateescape')).hexdigest()} -->\n"
    if _begins_with(out / PAGE, stamp) and (out / TABLE).is_file() and (out / FIGURE).is_file():
        return
    replace_text(out / TABLE, table)
    _draw(out / FIGURE, reduction, outcomes)
    replace_text(
        out / PAGE, stamp + _page(out, command, outcomes)
    )  # last: its stamp states that all three are complete


def table_text(out: Path, reduction: Reduction, outcomes: Sequence[Outcome]) -> str:
    """Return the text of batch.csv: one line per input, with empty cells for missing values."""
    rows = []
    for outcome in outcomes:
        cells = outcome.digest.cells if outcome.digest is not None else {}
        result = "" if outcome.folder is None else outcome.folder.name
        line: list[Cell] = [outcome.input, result, outcome.exit_code, outcome.words]
        line += [cells.get(name) for name in reduction.COLUMNS]
        seconds = f"{outcome.seconds:.3f}" if outcome.folder is not None else ""
        rows.append([*map(_no_formula, line), seconds])  # a negative number is no formula
    return lines_of((*FIRST_COLUMNS, *reduction.COLUMNS, "seconds"), rows)


def _no_formula(cell: Cell) -> Cell:
    """Put an apostrophe before a name that a spreadsheet would interpret as a formula."""
    return f"'{cell}" if isinstance(cell, str) and cell.startswith(("=", "+", "-", "@", "\t")) else cell


def _draw(path: Path, reduction: Reduction, outcomes: Sequence[Outcome]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_INCHES, layout="constrained")
    reduction.draw(figure, outcomes)
    with replaced(path, unique=f".{uuid4().hex[:8]}") as part:
        figure.savefig(part, dpi=DOTS_PER_INCH, format="png")


def _page(out: Path, command: str, outcomes: Sequence[Outcome]) -> str:
    from base64 import b64encode

    bad = sum(outcome.exit_code != 0 for outcome in outcomes)
    said = f"{len(outcomes)} inputs, {bad} of them with a message" if bad else f"{len(outcomes)} inputs, all done"
    picture = b64encode((out / FIGURE).read_bytes()).decode()
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" '
        f'content="width=device-width"><title>batch {command}: {html.escape(out.resolve().name)}</title>'
        f"<style>{STYLE}</style></head><body>\n<h1>batch {command}: {html.escape(out.resolve().name)}</h1>\n"
        f'<p>{said}. The table: <a href="{TABLE}">{TABLE}</a>.</p>\n'
        f'<img alt="all results" src="data:image/png;base64,{picture}">\n<div class="all">\n'
        + "".join(_tile(command, outcome) for outcome in sorted(outcomes, key=lambda one: one.exit_code == 0))
        + "</div></body></html>\n"
    )


def _tile(command: str, outcome: Outcome) -> str:
    name = html.escape(outcome.folder.name if outcome.folder else Path(outcome.input).name)
    title = html.escape(outcome.input, quote=True)
    if outcome.folder is not None:
        target = "report.html" if command == "diagnose" else "gap.png"
        name = f'<a href="{quote(outcome.folder.name, errors="surrogateescape")}/{target}">{name}</a>'
    lines = [f'<div class="one{" bad" if outcome.exit_code else ""}" title="{title}"><p>{name}</p>']
    if outcome.digest is not None:
        lines += [small_picture(outcome.digest.curve), f"<p>{html.escape(outcome.digest.caption)}</p>"]
    if outcome.words:
        lines.append(f"<p>{html.escape(outcome.words)}</p>")
    return "".join(lines) + "</div>\n"


def _begins_with(path: Path, text: str) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(len(text.encode())) == text.encode()
    except OSError:
        return False
