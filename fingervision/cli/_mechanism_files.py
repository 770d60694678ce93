"""Tables and plots of a mechanism whose drawing lists its bodies (mechanism.toml)."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingervision.cli._body_picture import draw_body, extent_mm, framed
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.mechanism_state import MechanismState
from fingervision.storage.simulation_csv import POSE

_STYLES = ("-", "--", "-.")
_IN_PLOT = 4
"""Most curves of a plot whose legend fits into it."""
_STILL = 0.01
"""If the relative change of a distance is smaller, the distance is plotted without its mean, whose digits would hide
the change."""


def write_figures(table: Mapping[str, Mapping[str, float]], path: Path) -> None:
    """Write models.csv: one line per kind of model, with empty cells for results that a kind does not compute."""
    labels = list(dict.fromkeys(label for figures in table.values() for label in figures))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["kind", *labels])
        for kind, figures in table.items():
            writer.writerow([kind, *(f"{figures[label]:.7g}" if label in figures else "" for label in labels)])


def write_states(states: Sequence[MechanismState], out: Path) -> None:
    """Write mechanism.csv, and also simulation.csv if a pair of probes is named gap."""
    columns: dict[str, list[float]] = {"input_mm": [s.input_mm for s in states], "force_n": [s.force_n for s in states]}
    if len(states[0].drives_n) > 1:
        columns |= {f"{name}_force_n": [s.drives_n[name] for s in states] for name in states[0].drives_n}
    for name in states[0].probes_mm:
        for place, axis in enumerate("xy"):
            columns[f"{name}_{axis}_mm"] = [s.probes_mm[name][place] for s in states]
    for name in states[0].pairs_mm:
        columns[f"{name}_mm"] = [s.pairs_mm[name] for s in states]
    for name in states[0].contact_n:
        columns[f"{name}_contact_n"] = [s.contact_n[name] for s in states]
    columns["stress_mpa"] = [s.stress_mpa for s in states]
    poses = {
        f"{name}.{part}": [getattr(s.bodies[name], part) for s in states] for name in states[0].bodies for part in POSE
    }
    columns |= poses
    _table(columns, out / "mechanism.csv")
    if "gap" in states[0].pairs_mm:
        table = {name: columns[name] for name in ("input_mm", "gap_mm", "force_n")} | poses
        _table(table, out / "simulation.csv")


def _table(columns: dict[str, list[float]], path: Path) -> None:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def draw_deformed(model: MechanismPlate, state: MechanismState, path: Path, *, large: bool) -> None:
    """Plot the deformed mechanism at one input, with displacements to scale and coloured by stress."""
    plate = model.plate
    moved: NDArray[np.float64] = state.displacement_mm
    stress = plate.at_corners(plate.von_mises_mpa(moved, large=large))
    figure, axes = framed(*extent_mm(plate, moved))
    colours = draw_body(axes, plate, moved, stress, max(state.stress_mpa, 1e-9))
    axes.set_title(
        f"{model.mechanism.name}: input {state.input_mm:.3g} mm, to scale, force {state.force_n:.3g} N\n"
        f"largest stress in a flexure {state.stress_mpa:.3g} MPa (yield {model.mechanism.material.yield_mpa:g} MPa)",
        fontsize="medium",
    )
    figure.colorbar(colours, ax=axes, label="von Mises stress / MPa", shrink=0.8)
    figure.savefig(path, dpi=130)


def draw_over_input(mechanism: Mechanism, states: Mapping[str, Sequence[MechanismState]], path: Path) -> None:
    """Plot distances of probe pairs (or single probes), force and stress over the input, for every kind of model."""
    figure = Figure(figsize=(9.5, 8.5), layout="constrained")
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 2))
    for place, (kind, rows) in enumerate(states.items()):
        inputs = [state.input_mm for state in rows]
        style = _STYLES[place % len(_STYLES)]
        for number, (name, lengths) in enumerate(_lengths(mechanism, rows).items()):
            still = np.ptp(lengths) < _STILL * max(np.abs(lengths))
            rest = round(float(np.mean(lengths)), 6) if still else 0.0
            shown = f"{name} minus {rest:g} mm" if rest else name
            upper.plot(inputs, np.array(lengths) - rest, style, color=f"C{number}", label=f"{shown} ({kind})")
        middle.plot(inputs, [state.force_n for state in rows], style, color="0.2", label=kind)
        for number, name in enumerate(rows[0].drives_n if len(mechanism.drives) > 1 else ()):
            forces = [state.drives_n[name] for state in rows]
            middle.plot(inputs, forces, style, color=f"C{number}", label=f"{name} ({kind})")
        lower.plot(inputs, [state.stress_mpa for state in rows], style, color="0.2", label=kind)
    upper.set_ylabel("distance / mm" if mechanism.pairs else "displacement / mm")
    if upper.lines:
        _beside(upper)
    middle.set_ylabel("force of the input / N" if len(mechanism.drives) > 1 else "force at the drive / N")
    _beside(middle)
    lower.axhline(mechanism.material.yield_mpa, color="C3", linewidth=0.8, linestyle=":")
    lower.annotate("yield", (1.0, mechanism.material.yield_mpa), xycoords=("axes fraction", "data"), color="C3",
                   xytext=(-4, -3), textcoords="offset points", ha="right", va="top", fontsize="small")  # fmt: skip
    lower.set_ylabel("stress in the flexures / MPa")
    lower.set_xlabel("input / mm")
    for axes in (upper, middle, lower):
        axes.grid(alpha=0.3)
    upper.set_title(f"{mechanism.name}: over the input")
    figure.savefig(path, dpi=130)


def _beside(axes: Axes) -> None:
    """Put a legend into the plot, or beside it where it would hide the curves."""
    if len(axes.lines) > _IN_PLOT:
        axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1.0))
    else:
        axes.legend(fontsize="small")


def _lengths(mechanism: Mechanism, rows: Sequence[MechanismState]) -> dict[str, list[float]]:
    if mechanism.pairs:
        return {name: [state.pairs_mm[name] for state in rows] for name in mechanism.pairs}
    return {
        f"{name} {axis}": [state.probes_mm[name][place] for state in rows]
        for name in mechanism.probes
        for place, axis in enumerate("xy")
    }
