"""`fingervision model --modes`: natural frequencies and the shapes of the finite elements' modes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

_FAMILIES = (
    ("drive free", False, 1.0),
    ("drive held", True, 1.0),
    ("swaying, drive free across", None, -1.0),
)
_MOST_DRAWN = 5
_SHOWN = 0.08
"""Of the body's height: the largest motion in a drawn shape."""


def write_modes(models: Mapping[str, Any], count: int, name: str, out: Path, *, as_json: bool) -> None:
    """Write modes.csv for every kind that vibrates, and modes.png of the finite elements."""
    lines = ["kind,family,number,frequency_hz"]
    for kind, model in models.items():
        half = getattr(model, "half", None)
        if half is None:
            continue
        for family, held, _ in _FAMILIES:
            rad_s, shapes = half.swaying_modes(count=count) if held is None else half.modes(
                drive_held=held, count=count)  # fmt: skip
            lines += [f"{kind},{family.replace(',', '')},{i},{w / (2 * np.pi):.7g}" for i, w in enumerate(rad_s, 1)]
            if not as_json:
                click.echo(f"{kind}, {family}: " + ", ".join(f"{w / (2 * np.pi):.5g}" for w in rad_s) + " Hz")
            del shapes
    (out / "modes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    if "finite_element" in models:
        _draw(models["finite_element"], min(count, _MOST_DRAWN), name, out / "modes.png")


def _way_to_meeting(x: NDArray[np.float64], across: NDArray[np.float64]) -> float:
    """How large a shape may be drawn before a point of the half meets the symmetry axis."""
    closing = (across < 0.0) & (x > 1e-9 * float(x.max()))
    return float(np.min(-x[closing] / across[closing], initial=np.inf))


def _draw(model: Any, count: int, name: str, path: Path) -> None:
    plate, half = model.plate, model.half
    corners = plate.corner_triangles
    nodes = int(corners.max()) + 1
    x, y = plate.nodes_mm[:, :nodes]
    figure = Figure(figsize=(2.6 * count + 0.6, 9.5), layout="constrained")
    figure.suptitle(f"{name}: natural modes in the plane, without the actuator's mass")
    rows = figure.subplots(len(_FAMILIES), count, squeeze=False)
    for row, (family, held, mirror) in zip(rows, _FAMILIES, strict=True):
        rad_s, shapes = half.swaying_modes(count=count) if held is None else half.modes(drive_held=held, count=count)
        for axes, angular, shape in zip(row, rad_s, shapes.T, strict=True):
            across, along = shape[plate.x_dofs[:nodes]], shape[plate.y_dofs[:nodes]]
            scale = _SHOWN * float(np.ptp(y)) / float(np.hypot(across, along).max())
            if mirror > 0.0:
                # Halves that mirror each other are drawn opening, and no farther than to where they would meet.
                ways = [_way_to_meeting(x, sign * across) for sign in (1.0, -1.0)]
                turned = 1.0 if ways[0] >= ways[1] else -1.0
                scale = turned * min(scale, max(ways))
            # The left half mirrors the right one; where both sway the same way its motion is turned round.
            for side, sign in ((1.0, 1.0), (-1.0, mirror)):
                moved = side * (x + sign * scale * across), y + sign * scale * along
                axes.triplot(Triangulation(side * x, y, corners.T), color="0.85", linewidth=0.2)
                axes.triplot(Triangulation(moved[0], moved[1], corners.T), color="C0", linewidth=0.2)
            axes.set_aspect("equal")
            axes.set_title(f"{family}\n{angular / (2 * np.pi):.4g} Hz", fontsize="small")
            axes.tick_params(labelsize="x-small")
    for axes in rows[-1]:
        axes.set_xlabel("x / mm", fontsize="small")
    for row in rows:
        row[0].set_ylabel("y / mm", fontsize="small")
    figure.savefig(path, dpi=120)
