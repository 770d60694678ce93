"""`fingervision model` with varied, wanted and uncertain dimensions: --vary, --solve, and standard uncertainties."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path

import click
import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingervision.cli._model_figures import save_figure
from fingervision.domain.gripper import Gripper
from fingervision.domain.numbers import with_uncertainty
from fingervision.models.finite_element import FiniteElementGripper, MechanismPlate
from fingervision.models.gripper_figures import label_of, unit_of, with_unit
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import by_trust
from fingervision.models.lumped import LumpedGripper, MechanismFrame
from fingervision.models.mechanism_figures import response_figures
from fingervision.models.parameter_sweep import (
    COLUMNS,
    Figures,
    Variation,
    mechanism_sweep_answers,
    parse_unknown,
    parse_variation,
    parse_wanted,
    solve_dimensions,
    sweep_answers,
    sweep_figures,
    varied,
)
from fingervision.models.uncertainty import FigureUncertainty
from fingervision.storage.mechanism_toml import MechanismDrawing
from fingervision.storage.out_folder import out_folder
from fingervision.storage.row_file import write_table

_MOST_ROWS_PRINTED = 40
_MOST_PANELS = 6
_ENDS = {"_mm": "mm", "_deg": "degrees", "_mpa": "MPa", "_kg_m3": "kg/m3", "_per_k": "1/K"}
Array = NDArray[np.float64]


def sweep(
    gripper: Gripper, name: str, texts: tuple[str, ...], theory: HingeTheory, out: Path, *, as_json: bool
) -> None:
    """Write vary.csv and vary.png of a gripper, and print the table."""
    variations = [parse_variation(text) for text in texts]
    values, answers = sweep_answers(gripper, variations, theory)
    _write(name, variations, values, COLUMNS, answers, out, as_json=as_json)


def sweep_mechanism(drawing: MechanismDrawing, texts: tuple[str, ...], out: Path, *, as_json: bool) -> None:
    """Write vary.csv and vary.png of a mechanism whose drawing lists its bodies, and print the table."""
    variations = [parse_variation(text) for text in texts]
    values, columns, answers = mechanism_sweep_answers(
        lambda changes: drawing.mechanism(changes, absolute=True), variations
    )
    _write(drawing.mechanism().name, variations, values, columns, answers, out, as_json=as_json)


def solve(gripper: Gripper, texts: tuple[str, ...], wanted: tuple[str, ...], out: Path, *, as_json: bool) -> None:
    """Find dimensions of a gripper for which its figures take wanted values; write solve.csv and print it."""

    def redrawn_to(values: Mapping[str, float]) -> Gripper:
        return varied(gripper, [Variation(name, ()) for name in values], tuple(values.values()))

    def drawn(name: str) -> float:
        varied(gripper, [Variation(name, ())], (0.0,))  # refuses what is no number of the drawing
        return float(attrgetter(name)(gripper))

    _solve(
        texts, wanted, out, drawn,
        lambda values: sweep_figures(LumpedGripper(redrawn_to(values))),
        lambda values: sweep_figures(FiniteElementGripper(redrawn_to(values))), as_json=as_json,
    )  # fmt: skip


def solve_mechanism(
    drawing: MechanismDrawing, texts: tuple[str, ...], wanted: tuple[str, ...], out: Path, *, as_json: bool
) -> None:
    """Find dimensions of a mechanism for which its figures take wanted values; write solve.csv and print it."""

    def model(kind: type[MechanismFrame | MechanismPlate], values: Mapping[str, float]) -> dict[str, float]:
        return response_figures(kind(drawing.mechanism(values, absolute=True)))

    kind = MechanismFrame if drawing.mechanism().flexures else MechanismPlate
    _solve(texts, wanted, out, drawing.value, partial(model, kind), partial(model, MechanismPlate), as_json=as_json)


def _solve(
    texts: tuple[str, ...], wanted: tuple[str, ...], out: Path, drawn: Callable[[str], float], lumped: Figures,
    elements: Figures, *, as_json: bool,
) -> None:  # fmt: skip
    as_drawn = dict(elements({}))
    unknowns = [parse_unknown(text, drawn) for text in texts]
    targets = parse_wanted(wanted, as_drawn)
    found = solve_dimensions(unknowns, targets, lumped, lambda values: elements(values) if values else as_drawn)
    rows = [(name, drawn(name), value) for name, value in found.values.items()]
    rows += [(name, value, found.found.get(name, np.nan)) for name, value in found.drawn.items()]
    with out_folder(out):
        write_table(out / "solve.csv", ("name", "drawn", "solved"), rows, digits=7)
    if as_json:
        click.echo(json.dumps({name: {"drawn": a, "solved": b} for name, a, b in rows}, indent=2))
        return
    asked = ", ".join(f"{name} = {value:.6g}" for name, value in targets.items())
    dimensions = ", ".join(f"{name} = {v:.6g} {number_unit(name)}" for name, v in found.values.items())
    click.echo(f"{dimensions} gives {asked}, by finite elements within 0.1 %. What changes with it:")
    width = max(len(name) for name, _, _ in rows)
    for name, before, after in rows:
        change = f"{100.0 * (after / before - 1.0):+.3g} %" if before and np.isfinite([before, after]).all() else ""
        click.echo(f"{name:<{width}}  {before:>10.5g}  {after:>10.5g}  {change}")


def number_unit(name: str) -> str:
    """Unit of a number in a drawing; lengths that the drawing defines in [lengths] are in mm."""
    return next((unit for end, unit in _ENDS.items() if name.endswith(end)), "mm" if "lengths." in name else "1")


def _write(
    name: str, variations: Sequence[Variation], values: Array, columns: Sequence[str], answers: Array, out: Path,
    *, as_json: bool,
) -> None:  # fmt: skip
    varied = [variation.name for variation in variations]
    table = np.concatenate([values, answers], axis=1)
    header = [*varied, *columns]
    with out_folder(out):
        write_table(out / "vary.csv", header, table.tolist(), digits=7)
        _draw(name, variations, values, columns, answers, out / "vary.png")
    if as_json:
        rows = [{k: (v if np.isfinite(v) else None) for k, v in zip(header, row, strict=True)}
                for row in table.tolist()]  # fmt: skip
        click.echo(json.dumps(rows, indent=2))
        return
    shown = [f"{n} [{number_unit(n)}]" for n in varied]
    shown += [with_unit(c) for c in columns]
    widths = [max(len(text), 10) for text in shown]
    click.echo("  ".join(f"{text:>{width}}" for text, width in zip(shown, widths, strict=True)))
    for row in table[:_MOST_ROWS_PRINTED].tolist():
        cells = (f"{value:.5g}" if np.isfinite(value) else "-" for value in row)
        click.echo("  ".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True)))
    if len(table) > _MOST_ROWS_PRINTED:
        click.echo(f"... {len(table) - _MOST_ROWS_PRINTED} more rows in {out / 'vary.csv'}")


def _draw(
    name: str, variations: Sequence[Variation], values: Array, columns: Sequence[str], answers: Array, path: Path
) -> None:
    """Plot every column over the number that varies fastest; colours show the first number if two numbers vary."""
    last = variations[-1]
    count = len(last.values)
    first = values[::count, 0]
    colours = mpl.colormaps["viridis"]
    scale = Normalize(float(first.min()), float(first.max()) if np.ptp(first) > 0.0 else float(first.min()) + 1.0)
    panels = [place for place in range(len(columns)) if np.isfinite(answers[:, place]).any()][:_MOST_PANELS]
    figure = Figure(figsize=(12.5, 3.4 * ((len(panels) + 2) // 3) + 0.6), layout="constrained")
    figure.suptitle(f"{name}: lumped model over {' and '.join(v.name for v in variations)}")
    grid = figure.subplots((len(panels) + 2) // 3, 3, squeeze=False).ravel()
    for axes, place in zip(grid, panels, strict=False):
        for row, value in enumerate(first):
            curve = answers[row * count : (row + 1) * count, place]
            colour = colours(scale(value)) if len(variations) > 1 else "C0"
            axes.plot(last.values, np.where(np.isfinite(curve), curve, np.nan), marker=".", color=colour)
        axes.set_ylabel(label_of(columns[place]), fontsize="small")
        axes.set_xlabel(f"{last.name} / {number_unit(last.name)}", fontsize="small")
        axes.grid(alpha=0.3)
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    if len(variations) > 1:
        label = f"{variations[0].name} / {number_unit(variations[0].name)}"
        figure.colorbar(ScalarMappable(scale, colours), ax=list(grid), label=label)
    save_figure(figure, path)


_LEFT_OUT = ("peak_x_mm", "peak_y_mm", "lowest_input_mm", "highest_input_mm")
_HEADER = ("kind", "figure", "unit", "value", "u", "method", "low_95", "high_95", "first", "first_share", "second",
           "second_share", "third", "third_share")  # fmt: skip
_DRAWN = (
    "gap_per_input",
    "input_stiffness_n_mm",
    "peak_stress_mpa_per_mm",
    "input_at_yield_mm",
    "first_mode_drive_free_hz",
    "first_mode_drive_held_hz",
    "contact_input_mm",
    "mechanical_advantage",
)


def write_uncertainty(
    found: Mapping[str, FigureUncertainty], rows: Mapping[str, Mapping[str, float | None]], name: str, out: Path,
    *, as_json: bool,
) -> None:  # fmt: skip
    """Write uncertainty.csv and uncertainty.png, and print the most accurate model's results and main contributions.

    Parameters
    ----------
    found : mapping of str to FigureUncertainty
        Uncertainty of every result, by the name of the result.
    rows : mapping of str to mapping
        Results of every kind of model, written beside the uncertainties.
    name : str
        Name of the mechanism.
    out : Path
        Folder to write to.
    as_json : bool
        Whether the output is JSON, so that this function prints nothing.
    """
    lines = []
    for kind, row in rows.items():
        for figure, own in _stated(found, row).items():
            value = float(row[figure] or 0.0)
            low, high = (value + end - own.value for end in own.interval)
            shares = [part for n, share in own.shares for part in (n, f"{share:.3f}")]
            cells = [kind, figure, unit_of(figure), value, own.u, _method(own), low, high, *shares]
            lines.append(cells + [""] * (len(_HEADER) - len(cells)))
    write_table(out / "uncertainty.csv", _HEADER, lines, digits=6)
    best = by_trust(rows)[0]
    stated = _stated(found, rows[best])
    _draw_shares(stated, rows[best], f"{name}: {best}", out / "uncertainty.png")
    if as_json:
        return
    click.echo(f"Standard uncertainties of the results, caused by the uncertain numbers of the drawing ({best}):")
    width = max((len(figure) for figure in stated), default=0) + 2
    for figure, own in stated.items():
        most = ", ".join(f"{n} {100.0 * share:.0f} %" for n, share in own.shares if share >= 0.005)
        words = f"{with_uncertainty(float(rows[best][figure] or 0.0), own.u)} {unit_of(figure)}"
        click.echo(f"  {figure:<{width}}{words:<34}{_method(own):<9}{most}")


def _stated(found: Mapping[str, FigureUncertainty], row: Mapping[str, float | None]) -> dict[str, FigureUncertainty]:
    return {f: own for f, own in found.items() if f not in _LEFT_OUT and row.get(f) is not None}


def _method(own: FigureUncertainty) -> str:
    return "sampled" if own.sampled else "linear"


def _draw_shares(
    stated: Mapping[str, FigureUncertainty], row: Mapping[str, float | None], title: str, path: Path
) -> None:
    """Plot, for the main results, the contribution of each dimension to the variance."""
    names = [figure for figure in _DRAWN if figure in stated] or list(stated)[: len(_DRAWN)]
    inputs = list(dict.fromkeys(n for figure in names for n, _ in stated[figure].shares))
    figure = Figure(figsize=(9.0, 1.6 + 0.5 * max(len(names), 1)), layout="constrained")
    axes = figure.add_subplot()
    for place, name in enumerate(names):
        left = 0.0
        for n, share in stated[name].shares:
            axes.barh(place, 100.0 * share, left=left, color=f"C{inputs.index(n)}")
            left += 100.0 * share
    for place, n in enumerate(inputs):
        axes.barh(0, 0.0, color=f"C{place}", label=n)
    labels = [f"{n}\n{with_uncertainty(float(row[n] or 0.0), stated[n].u)} {unit_of(n)}" for n in names]
    axes.set_yticks(range(len(names)), labels, fontsize="small")
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("share of the variance by the three numbers that contribute most / %")
    axes.set_title(f"{title}, standard uncertainties", fontsize="medium")
    if inputs:
        axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    save_figure(figure, path)
