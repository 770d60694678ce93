"""`fingervision table`: show how a table of another program is interpreted; save the interpretation."""

import pkgutil
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fingervision.cli._command import FILE, make_command, option
from fingervision.cli._options import columns_option, figure_option, json_option, out_option

if TYPE_CHECKING:
    from fingervision.tables.account import Account
    from fingervision.tables.mapping import Entry

# Their names alone: the formats themselves import libraries that take a second.
FORMATS = sorted(each.name for each in pkgutil.iter_modules([str(Path(__file__).parents[1] / "tables" / "formats")]))

EXAMPLES = f"""
\b
Examples:
  fingervision table stage.lvm
  fingervision table comsol.txt --kind simulation
  fingervision table table1.csv --kind simulation --set columns.gap=comsol_mm
  fingervision table log.csv --set units.time=ms --set units.input='0.1 um'
  fingervision table stage.lvm --figure stage.png

\b
Formats: {", ".join(name for name in FORMATS if name[0] != "_")} (text: any convention, such as CSV and COMSOL).

\b
Keys of --set and of columns.toml:
  columns.ROLE  name or number of the column: time, input, gap, left, right, force, run, target, position, ...
  units.ROLE    unit of the column, or what one count is worth: mm, um, ms, '0.1 um'
  separator , ; tab | blank     decimal . ,       encoding    header_line (0: none)      part (sheet, group, variable)
  runs restart|one              date_order dmy|mdy|ymd        missing (such as -9999)      accept (checked doubts)
  clock continuous|as_written   (a clock that was set, or a counter that ran over)

\b
Exit codes: 0 interpreted, and columns.toml is written; 1 ambiguous: the message names the key of --set that decides.
"""


@make_command(EXAMPLES)
@click.argument("file", type=FILE)
@option(
    "--kind",
    type=click.Choice(["measured", "drive", "simulation"]),
    former=("--as",),
    help="Kind of table; recognised if not given.",
)
@option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Set one key of columns.toml; repeatable.")
@columns_option
@out_option(words="File to write; columns.toml beside FILE if not given.", kind=FILE)
@figure_option("Also plot the curve to this picture.", "--png")
@json_option("Print the interpretation as JSON.")
def command(
    file: Path,
    kind: str | None,
    settings: tuple[str, ...],
    columns: Path | None,
    out: Path | None,
    figure: Path | None,
    as_json: bool,
) -> None:
    """Show how FILE, a table of any program, is interpreted, and write this interpretation to columns.toml.

    Every command that reads a table uses the columns.toml beside that table, or the file that --columns names.
    """
    import json

    from fingervision.tables.account import account
    from fingervision.tables.mapping import KINDS, NAME, entry_for, entry_of_settings, write_entry
    from fingervision.tables.questions import OpenQuestionError

    target = out or columns or file.parent / NAME
    decided = {each: entry_for(file, each, columns) for each in KINDS}
    own = entry_of_settings(settings, target)
    if settings:
        decided = {each: own.over(entry) for each, entry in decided.items()}
    try:
        found = account(file, kind, decided)
    except OpenQuestionError:
        # What is stated once stays, whatever else is open.
        _keep(settings, target, file, kind, own)
        raise
    if as_json:
        click.echo(json.dumps(found.document(), indent=2, allow_nan=False, ensure_ascii=False))
    else:
        _print(found)
    if figure is not None:
        _draw(found, figure)
    if found.question is not None:
        if isinstance(found.question, OpenQuestionError):
            _keep(settings, target, file, None if found.also else found.kind, decided[found.kind])
        raise found.question
    if found.own:
        _say("The table needs no columns.toml.", quiet=as_json)
        return
    changed = write_entry(target, _name_for(file, target), None if found.also else found.kind, found.entry)
    _say(f"{'Written' if changed else 'Unchanged'}: {target}", quiet=as_json)


def _keep(settings: tuple[str, ...], target: Path, file: Path, kind: str | None, entry: "Entry") -> None:
    """Write the decisions of the user although others are open."""
    from fingervision.tables.mapping import write_entry

    if settings:
        write_entry(target, _name_for(file, target), kind, entry)


def _name_for(file: Path, target: Path) -> str:
    """Path of the table relative to the folder of columns.toml."""
    import os

    return Path(os.path.relpath(file.resolve(), target.parent.resolve())).as_posix()


def _say(words: str, *, quiet: bool) -> None:
    if not quiet:
        click.echo(words)


def _print(found: "Account") -> None:
    import sys

    from fingervision.tables.account import terminal_plot

    document = found.document()
    click.echo(f"{found.path}: {found.what}")
    rate = "" if found.rate_hz is None else f", {found.rate_hz:.6g} rows a second"
    words = {"drive": "a drive"}.get(found.kind, f"a {found.kind} table")
    if found.also:
        words = f"a {found.kind} or {found.also} table (the file does not say which; both are read in the same way)"
    click.echo(f"read as {words}, {found.rows} rows{rate}")
    if document["columns"]:
        rows = [("column", "unit in file", "read as", "range")]
        for each in document["columns"]:
            values = ""
            if each["range"] is not None:
                values = f"{each['range'][0]:.6g} to {each['range'][1]:.6g} {each['range_unit']}".rstrip()
            missing = f" ({each['missing']} missing)" if each["missing"] else ""
            rows.append((each["name"] or "(no name)", each["unit"] or "?", each["read_as"], values + missing))
        wide = [max(len(row[k]) for row in rows) for k in range(3)]
        for row in rows:
            click.echo("  " + "  ".join([*(f"{row[k]:<{wide[k]}}" for k in range(3)), row[3]]).rstrip())
    if found.channels.names:
        listed = ", ".join(f"{text} as {name}" for name, text in found.channels.names.items())
        click.echo(f"  channels: {listed}")
    if found.unused:
        click.echo(f"  not used: {', '.join(name or '(no name)' for name in found.unused)}")
    for sentence in found.left_out:
        click.echo(f"  left out: {sentence}")
    for sentence in found.notes:
        click.echo(f"  note: {sentence}")
    if (curve := found.curve()) is not None:
        plain = not (sys.stdout.encoding or "").lower().startswith("utf")
        click.echo("\n".join(terminal_plot(*curve, plain=plain)))


def _draw(found: "Account", png: Path) -> None:
    """Plot the curve of the table as interpreted, with the file's name as title."""
    from fingervision.domain.errors import DataError, OutputError

    curve = found.curve()
    if curve is None:
        raise found.question or DataError(f"{found.path} has no two columns to draw: leave out --figure.")
    from matplotlib.figure import Figure

    x_name, x, y_name, y = curve
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(x, y, ".-", markersize=3, linewidth=0.6)
    labels = {"time_s": "time (s)", "input_mm": "input (mm)", "gap_mm": "gap (mm)"}
    axes.set_xlabel(labels.get(x_name, x_name))
    axes.set_ylabel(labels.get(y_name, y_name))
    axes.set_title(f"{found.path.name}, read as {found.kind}", fontsize=10)
    try:
        figure.savefig(png, dpi=120)
    except (OSError, ValueError) as error:
        raise OutputError(f"{png} could not be written ({error}): name another picture, such as t.png.") from error
