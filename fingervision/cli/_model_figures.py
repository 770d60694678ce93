"""Plots of the `model` command: the deformed body with its stress, and the gap over the input with differences."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingervision.cli._body_picture import draw_body, extent_mm, framed
from fingervision.models import reference_mesh
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.triangulate import PlaneMesh

Array = NDArray[np.float64]

_PUBLISHED = (
    ("paper: SimMechanics", reference_mesh.SIMMECHANICS_MM, "s"),
    ("paper: Comsol", reference_mesh.COMSOL_MM, "^"),
    ("paper: experiment", reference_mesh.EXPERIMENT_MM, "o"),
)


def draw_deformed(model: FiniteElementGripper, input_mm: float, name: str, path: Path) -> None:
    """Plot both halves at one input as the model computes them, with displacements to scale and coloured by stress.

    Without contact in the model, an input beyond the first touch would show the fingers penetrating each other; the
    state at the first touch is then plotted instead.
    """
    onset_mm = model.contact_onset_mm
    beyond = onset_mm is not None and not model.physics.contact and input_mm < onset_mm
    if beyond and onset_mm is not None:
        input_mm = onset_mm
    moved = model.equilibria([input_mm])[0].displacement
    state = model.loaded([input_mm])[0]
    plate = model.plate
    stress = plate.at_corners(plate.von_mises_mpa(moved, large=model.physics.large_rotation))
    figure, axes = framed(*extent_mm(plate, moved, mirrored=True))
    for side in (1.0, -1.0):
        colours = draw_body(axes, plate, moved, stress, max(state.stress_mpa, 1e-9), side=side)
    limit_mpa = model.gripper.material.yield_mpa
    touch = " (first touch; no contact force is computed beyond it)" if beyond else ""
    grip = f", grip {state.grip_n:.3g} N a finger" if state.grip_n > 0.0 else ""
    axes.set_title(
        f"{name}: input {input_mm:.3g} mm{touch}, to scale{grip}\nlargest stress on a notch {state.stress_mpa:.3g} MPa "
        f"at x = {state.place_mm[0]:.3g}, y = {state.place_mm[1]:.3g} mm (yield {limit_mpa:g} MPa)"
    )
    figure.colorbar(colours, ax=axes, label="von Mises stress / MPa", shrink=0.8)
    figure.savefig(path, dpi=130)


def draw_mesh(mesh: PlaneMesh, name: str, path: Path) -> None:
    """Plot the triangles of the mesh, with their number and quality in the title."""
    figure, axes = framed(mesh.nodes_mm.min(axis=1), mesh.nodes_mm.max(axis=1))
    axes.triplot(Triangulation(mesh.nodes_mm[0], mesh.nodes_mm[1], mesh.triangles[:3].T), color="0.3", linewidth=0.25)
    quality = mesh.quality()
    axes.set_title(
        f"{name}: {mesh.triangles.shape[1]} quadratic triangles, {2 * mesh.nodes_mm.shape[1]} unknowns\n"
        f"quality {quality.min():.2f} at least, {quality.mean():.2f} in the mean (1: equilateral)"
    )
    figure.savefig(path, dpi=200)


def draw_comparison(tables: Mapping[str, Mapping[str, Array]], name: str, path: Path, *, with_published: bool) -> None:
    """Plot the gap over the input for every model, and the differences between models below.

    For the published gripper, the published results are also plotted, and the differences are taken from the published
    experiment; for any other gripper, the differences are taken from the first model.
    """
    figure = Figure(figsize=(8.0, 7.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    colours = mpl.colormaps["tab10"]
    kinds = list(tables)
    inputs = tables[kinds[0]]["input_mm"]
    if with_published:
        at, reference = reference_mesh.INPUT_MM, reference_mesh.EXPERIMENT_MM
        title = "gap minus experiment / mm"
    else:
        at, reference = inputs, tables[kinds[0]]["gap_mm"]
        title = f"gap minus {kinds[0]} / mm"
    for place, kind in enumerate(kinds):
        gap = tables[kind]["gap_mm"]
        upper.plot(inputs, gap, color=colours(place), linestyle=("-", "--", "-.")[place % 3], label=kind)
        inside = (at >= inputs.min() - 1e-9) & (at <= inputs.max() + 1e-9)
        difference = np.interp(at[inside], inputs, gap) - reference[inside]
        lower.plot(at[inside], difference, color=colours(place), linestyle=("-", "--", "-.")[place % 3])
    if with_published:
        for place, (source, column, marker) in enumerate(_PUBLISHED):
            upper.plot(at, column, marker, color=colours(place + 4), label=source, markersize=5, fillstyle="none")
            if source != "paper: experiment":
                lower.plot(at, column - reference, marker, color=colours(place + 4), markersize=5, fillstyle="none")
    upper.set_ylabel("gap / mm")
    upper.legend()
    upper.grid(alpha=0.3)
    lower.axhline(0.0, color="0.4", linewidth=0.8)
    lower.set_ylabel(title)
    lower.set_xlabel("input / mm")
    lower.grid(alpha=0.3)
    chosen = "; one link length was fitted to this slope: no validation" if with_published else ""
    upper.set_title(f"{name}{chosen}", fontsize="medium")
    figure.savefig(path, dpi=130)
