"""`fingervision model --vary` and `--solve`: results over dimensions of the drawing, and dimensions for results."""

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

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper, MechanismPlate
from fingervision.models.gripper_figures import label_of, unit_of
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.inverse_design import Figures, parse_unknown, parse_wanted, solve_dimensions
from fingervision.models.lumped import LumpedGripper, MechanismFrame
from fingervision.models.mechanism_figures import response_figures
from fingervision.models.parameter_sweep import (
    COLUMNS,
    Variation,
    mechanism_sweep_answers,
    parse_variation,
    sweep_answers,
    sweep_figures,
    varied,
)
from fingervision.storage.mechanism_toml import MechanismDrawing
from fingervision.storage.out_folder import out_folder

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
    lines = ["name,drawn,solved", *(f"{name},{before:.7g},{after:.7g}" for name, before, after in rows)]
    with out_folder(out):
        (out / "solve.csv").write_text("\n".join(lines).replace("nan", "").replace("-inf", "") + "\n", encoding="utf-8")
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
    lines = [",".join(header), *(",".join(f"{v:.7g}" if np.isfinite(v) else "" for v in row) for row in table)]
    with out_folder(out):
        (out / "vary.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        _draw(name, variations, values, columns, answers, out / "vary.png")
    if as_json:
        rows = [{k: (v if np.isfinite(v) else None) for k, v in zip(header, row, strict=True)}
                for row in table.tolist()]  # fmt: skip
        click.echo(json.dumps(rows, indent=2))
        return
    shown = [f"{n} [{number_unit(n)}]" for n in varied]
    shown += [c if c.endswith("]") else f"{c} [{unit_of(c)}]" for c in columns]
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
    figure.savefig(path, dpi=130)
