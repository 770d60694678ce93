"""`fingervision model` with files of CAD programs: a drawing begun from a DXF or SVG file, and --export."""

import json
import os
from pathlib import Path

import click
import numpy as np

from fingervision.cli._model_figures import framed
from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.mechanism import Mechanism
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.strips import strips_of
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import is_mechanism, read_mechanism
from fingervision.storage.out_folder import make_out_folder, out_folder
from fingervision.storage.outline_file import read_outline, write_outline

_BEGUN = """\
# Drawing begun from {source}: x {x0:.6g} to {x1:.6g}, y {y0:.6g} to {y1:.6g} mm, see {name}.png.
# Complete the lines that begin with #? (thickness, material, clamped and driven faces), then run
#   fingervision model {name}.toml
schema = 1
name = "{name}"
#? plate_mm = 5.0                  # thickness of the plate

[material]
#? name = "PA12"
#? youngs_modulus_mpa = 1650.0
#? poisson_ratio = 0.39
#? density_kg_m3 = 930.0
#? yield_mpa = 48.0

[[body]]
name = "plate"
outline = "{path}"{how}

[[fixed]]                          # x from, x to, y from, y to of a box around the clamped part of the outline
#? box_mm = [{x0:.6g}, {x1:.6g}, {y0:.6g}, {y0:.6g}]

[drive]                            # the driven part of the outline, and the direction of its motion
#? box_mm = [{x0:.6g}, {x1:.6g}, {y1:.6g}, {y1:.6g}]
#? direction = [1, 0]
across = "free"

# Points whose motion is observed: [[probe]] with name and at_mm; a [[pair]] of two of them is a gap.
"""


def begin_drawing(source: Path, out: Path, layer: str, unit_mm: float | None) -> None:
    """Write NAME.toml, a drawing to complete, and NAME.png, the outline with its flexures, from a DXF or SVG file."""
    steps, unit_words = read_outline(source, layer, unit_mm)
    region = PlanarRegion(steps)
    strips, name = strips_of(region, ()), source.stem
    lines = [curve.at(np.linspace(curve.t0, curve.t1, 33)) for loop in region.loops for curve in loop.curves]
    points = np.concatenate(lines, axis=1)
    low, high = points.min(axis=1), points.max(axis=1)
    make_out_folder(out)
    with out_folder(out):
        (x0, y0), (x1, y1) = np.round((low, high), 6) + 0.0  # without minus zero
        path = Path(os.path.relpath(source, out)).as_posix()
        how = f"\nlayer = {json.dumps(layer)}" * bool(layer)
        how += "" if unit_mm is None else f"\nunit_mm = {unit_mm:g}"
        text = _BEGUN.format(source=source.name, name=name, path=path, how=how, x0=x0, x1=x1, y0=y0, y1=y1)
        (out / f"{name}.toml").write_text(text, encoding="utf-8")
        figure, axes = framed(low, high)
        for x, y in lines:
            axes.plot(x, y, color="0.2", linewidth=0.8)
        for strip in strips:
            axes.annotate(strip.name, strip.at_mm, color="C3", fontsize="small", ha="center", va="center")
        axes.grid(alpha=0.3)
        axes.set_title(f"{name}: outline", fontsize="medium")
        figure.savefig(out / f"{name}.png", dpi=130)
    if unit_words:
        click.echo(unit_words)
    click.echo(
        f"{source.name}: {x1 - x0:.6g} by {y1 - y0:.6g} mm, closed outlines: {len(region.loops)}, strips and notches "
        f"that are flexures: {len(strips)}. Complete the lines that begin with #? of {out / name}.toml with the help "
        f"of {out / name}.png, then run fingervision model {out / name}.toml."
    )


def export(path: Path, targets: tuple[Path, ...]) -> None:
    """Write the outline or the solid of a drawing for a cutter or printer."""
    if is_mechanism(path):
        mechanism: Mechanism = read_mechanism(path)
    else:
        gripper = read_gripper(path)
        mechanism = whole_mechanism(gripper, gripper, path.stem)
    for target in targets:
        with out_folder(target.parent):
            click.echo(write_outline(target, mechanism))
