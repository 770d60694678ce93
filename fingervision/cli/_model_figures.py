"""Figures of the `model` command: the deformed body with its stress, and the paper's Figure 9 with differences."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingervision.domain.response import Response
from fingervision.models import published_table
from fingervision.models.finite_element import FiniteElementGripper

Array = NDArray[np.float64]

_PUBLISHED = (
    ("paper: SimMechanics", published_table.SIMMECHANICS_MM, "s"),
    ("paper: Comsol", published_table.COMSOL_MM, "^"),
    ("paper: experiment", published_table.EXPERIMENT_MM, "o"),
)


def draw_deformed(model: FiniteElementGripper, input_mm: float, path: Path) -> None:
    """Draw both halves at one input, displacements to scale, coloured by von Mises stress."""
    moved = input_mm * model.half.unit_displacement_mm
    plate = model.plate
    corners = plate.corner_triangles
    stress = plate.at_corners(plate.von_mises_mpa(moved))
    count = stress.size
    x, y = plate.nodes_mm[:, :count]
    deformed = x + moved[plate.x_dofs[:count]], y + moved[plate.y_dofs[:count]]
    figure = Figure(figsize=(7.0, 7.6), layout="constrained")
    axes = figure.add_subplot()
    colours = None
    for side in (1.0, -1.0):
        axes.triplot(Triangulation(side * x, y, corners.T), color="0.9", linewidth=0.2)
    for side in (1.0, -1.0):
        shape = Triangulation(side * deformed[0], deformed[1], corners.T)
        colours = axes.tripcolor(shape, stress, shading="gouraud", cmap="viridis", vmin=0.0, vmax=_top(model, input_mm))
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    peak = model.peak_stress()
    limit_mpa = model.gripper.material.yield_mpa
    axes.set_title(
        f"Input {input_mm:.3g} mm, to scale; largest stress on a notch {peak.mpa_per_mm * abs(input_mm):.3g} MPa"
        f"\nat x = {peak.place_mm[0]:.3g}, y = {peak.place_mm[1]:.3g} mm (yield {limit_mpa:g} MPa)"
    )
    if colours is not None:
        figure.colorbar(colours, ax=axes, label="von Mises stress / MPa", shrink=0.8)
    figure.savefig(path, dpi=130)


def _top(model: FiniteElementGripper, input_mm: float) -> float:
    return max(model.peak_stress().mpa_per_mm * abs(input_mm), 1e-9)


def draw_comparison(inputs: Array, answers: Mapping[str, Response], path: Path, *, with_published: bool) -> None:
    """Draw the gap over the input of every model, and below it the differences.

    With the paper's gripper its published columns stand beside them and differences are from its experiment; otherwise
    they are from the first model.
    """
    figure = Figure(figsize=(8.0, 7.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    colours = mpl.colormaps["tab10"]
    names = list(answers)
    if with_published:
        at, reference = published_table.INPUT_MM, published_table.EXPERIMENT_MM
        title = "gap minus experiment / mm"
    else:
        at, reference = inputs, answers[names[0]].gap_mm
        title = f"gap minus {names[0]} / mm"
    for place, name in enumerate(names):
        gap = answers[name].gap_mm
        upper.plot(inputs, gap, color=colours(place), linestyle=("-", "--", "-.")[place % 3], label=name)
        inside = (at >= inputs.min() - 1e-9) & (at <= inputs.max() + 1e-9)
        difference = np.interp(at[inside], inputs, gap) - reference[inside]
        lower.plot(at[inside], difference, color=colours(place), linestyle=("-", "--", "-.")[place % 3])
    if with_published:
        for place, (name, column, marker) in enumerate(_PUBLISHED):
            upper.plot(at, column, marker, color=colours(place + 4), label=name, markersize=5, fillstyle="none")
            if name != "paper: experiment":
                lower.plot(at, column - reference, marker, color=colours(place + 4), markersize=5, fillstyle="none")
    upper.set_ylabel("gap / mm")
    upper.legend()
    upper.grid(alpha=0.3)
    lower.axhline(0.0, color="0.4", linewidth=0.8)
    lower.set_ylabel(title)
    lower.set_xlabel("input / mm")
    lower.grid(alpha=0.3)
    if with_published:
        upper.set_title("One link length was chosen on the paper's Comsol slope: no validation", fontsize="medium")
    figure.savefig(path, dpi=130)
