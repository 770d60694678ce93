"""Plots of the `model` command: bodies with their stress, and the gap over the input with differences."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import click
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from fingervision.diagnosis.report.vector_figure import write_vector
from fingervision.models import reference_mesh
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.triangulate import PlaneMesh

Array = NDArray[np.float64]

_LEAST_INCHES, _MOST_INCHES = 5.0, 9.0
_TITLE_INCHES, _BESIDE_INCHES = 1.2, 1.8
"""Height needed by title and axis labels, and width needed by axis labels and colour bar, in inches."""
_LEAST_WIDE_INCHES = 7.5
"""Smallest width in inches, which a title of two lines needs."""
_ON_AXIS = 1e-9
"""Tolerance relative to the size of the body: edges that are nearer to the symmetry axis lie on the axis."""
_COLOURS = "YlOrRd"
"""Colour map that is pale at zero stress, so that the shape of the body remains visible."""


@dataclass(frozen=True, slots=True)
class FigureStyle:
    """What a user asks of figures.

    Parameters
    ----------
    magnify : float
        Factor by which displacements are drawn larger.
    colour : str
        What colours a deformed body: `stress` or `displacement`.
    vector : bool
        Whether every figure is also written as SVG and PDF.
    """

    magnify: float = 1.0
    colour: str = "stress"
    vector: bool = False

    @classmethod
    def asked(cls) -> "FigureStyle":
        """Return the style that the options of the running command ask for."""
        context = click.get_current_context(silent=True)
        given = {} if context is None else context.params
        return cls(**{each.name: given[each.name] for each in fields(cls) if each.name in given})

    @property
    def words(self) -> str:
        """Scale of the displacements, for a title."""
        return "to scale" if self.magnify == 1.0 else f"displacements times {self.magnify:g}"


def save_figure(figure: Figure, path: Path, dpi: int = 130) -> None:
    """Write a figure as PNG, and as SVG and PDF beside it if they are asked for."""
    figure.savefig(path, dpi=dpi)
    if FigureStyle.asked().vector:
        write_vector(figure, path.with_suffix(""))


def framed(low: Array, high: Array) -> tuple[Figure, Axes]:
    """Make a figure with the proportions of its content.

    Parameters
    ----------
    low, high : ndarray of float, shape (2,)
        Lower left and upper right corner of the content's bounding box, in mm.
    """
    wide, tall = (high - low).tolist()
    scale = min((_MOST_INCHES - _BESIDE_INCHES) / wide, (_MOST_INCHES - _TITLE_INCHES) / tall)
    size = (max(scale * wide + _BESIDE_INCHES, _LEAST_WIDE_INCHES), max(scale * tall + _TITLE_INCHES, _LEAST_INCHES))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    return figure, axes


def draw_body(
    axes: Axes, plate: PlaneStressPlate, moved: Array, stress: Array, top_mpa: float, *, side: float | None = None
) -> tuple[Any, str]:
    """Draw a body's outline at rest and its deformed shape in colours; return the data for a colour bar and its label.

    Parameters
    ----------
    axes : Axes
        Axes to draw on.
    plate : PlaneStressPlate
        The meshed body.
    moved : ndarray of float, shape (unknowns,)
        Displacements in mm, drawn with the magnification that is asked for.
    stress : ndarray of float, shape (corners,)
        Von Mises stress at the corners, in MPa.
    top_mpa : float
        Stress at the upper end of the colour scale.
    side : float or None
        For a body that is symmetric about the y axis and of which only the right half is meshed: 1 draws the right
        half, and -1 its mirror image; the y axis, along which the halves join, is not drawn as an edge. None for a
        complete body.
    """
    x, y = plate.nodes_mm
    style = FigureStyle.asked()
    u, v = style.magnify * moved[plate.x_dofs], style.magnify * moved[plate.y_dofs]
    colour, top, label = stress, top_mpa, "von Mises stress / MPa"
    if style.colour == "displacement":
        colour, label = np.hypot(u, v)[: stress.size] / style.magnify, "displacement / mm"
        top = max(float(colour.max()), 1e-12)
    ends = plate.outline_edges[[0, 2, 1]]
    if side is not None:
        ends = ends[:, np.abs(x[ends]).max(axis=0) > _ON_AXIS * np.ptp(plate.nodes_mm)]
    side = side or 1.0
    count = stress.size
    at_rest, there = (np.stack([side * a[ends], b[ends]]).T for a, b in ((x, y), (x + u, y + v)))
    # All edges are one collection: a separate line for each edge would take longer than the finite elements.
    axes.add_collection(LineCollection(list(at_rest), colors="0.6", linewidths=0.6, zorder=1))
    shape = Triangulation(side * (x + u)[:count], (y + v)[:count], np.asarray(plate.corner_triangles).T)
    colours = axes.tripcolor(
        shape, colour, shading="gouraud", cmap=_COLOURS, vmin=0.0, vmax=top, zorder=2, rasterized=True
    )
    axes.add_collection(LineCollection(list(there), colors="0.2", linewidths=0.6, zorder=3))
    axes.autoscale_view()
    return colours, label


def extent_mm(plate: PlaneStressPlate, moved: Array, *, mirrored: bool = False) -> tuple[Array, Array]:
    """Bounding box that contains a body both at rest and deformed, in mm."""
    at_rest = plate.nodes_mm
    there = at_rest + FigureStyle.asked().magnify * np.stack([moved[plate.x_dofs], moved[plate.y_dofs]])
    both = np.hstack([at_rest, there])
    if mirrored:
        both = np.hstack([both, both * np.array([[-1.0], [1.0]])])
    return both.min(axis=1), both.max(axis=1)


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
        colours, label = draw_body(axes, plate, moved, stress, max(state.stress_mpa, 1e-9), side=side)
    limit_mpa = model.gripper.material.yield_mpa
    touch = " (first touch; no contact force is computed beyond it)" if beyond else ""
    grip = f", grip {state.grip_n:.3g} N a finger" if state.grip_n > 0.0 else ""
    axes.set_title(
        f"{name}: input {input_mm:.3g} mm{touch}, {FigureStyle.asked().words}{grip}\n"
        f"largest stress on a notch {state.stress_mpa:.3g} MPa "
        f"at x = {state.place_mm[0]:.3g}, y = {state.place_mm[1]:.3g} mm (yield {limit_mpa:g} MPa)"
    )
    figure.colorbar(colours, ax=axes, label=label, shrink=0.8)
    save_figure(figure, path)


def draw_mesh(mesh: PlaneMesh, name: str, path: Path) -> None:
    """Plot the triangles of the mesh, with their number and quality in the title."""
    figure, axes = framed(mesh.nodes_mm.min(axis=1), mesh.nodes_mm.max(axis=1))
    shape = Triangulation(mesh.nodes_mm[0], mesh.nodes_mm[1], mesh.triangles[:3].T)
    axes.triplot(shape, color="0.3", linewidth=0.25, rasterized=True)
    quality = mesh.quality()
    axes.set_title(
        f"{name}: {mesh.triangles.shape[1]} quadratic triangles, {2 * mesh.nodes_mm.shape[1]} unknowns\n"
        f"quality {quality.min():.2f} at least, {quality.mean():.2f} in the mean (1: equilateral)"
    )
    save_figure(figure, path, dpi=200)


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
    save_figure(figure, path)
