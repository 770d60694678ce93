"""`fingervision measure --mechanism`: the bodies of a drawing, followed through a recording."""

from pathlib import Path

import click

from fingervision.domain.errors import UsageError
from fingervision.frames.source import FrameSource
from fingervision.measuring.body_poses import measure_bodies
from fingervision.measuring.drawing_placement import parse_point
from fingervision.measuring.scale import Scale
from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.mechanism import Mechanism
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import is_mechanism, read_mechanism


def follow_bodies(
    source: FrameSource, drawing: Path, points: tuple[str, ...], scale: Scale, folder: Path, as_json: bool
) -> None:
    """Follow the bodies, write bodies.csv, and say how often each was seen."""
    given = [parse_point(text) for text in points]
    if getattr(scale, "lens", None) is not None or getattr(scale, "plane", None) is not None:
        raise UsageError(
            "--mechanism takes poses by the scale alone, but the calibration holds a lens or a plane: calibrate with a "
            "bar or a slot in the plane of the mechanism, or give --px-per-mm."
        )
    done = measure_bodies(source, mechanism_of(drawing), scale.px_per_mm, given, folder)
    if as_json:
        return
    for name, counts in done.counts.items():
        total = sum(counts.values())
        others = ", ".join(f"{count} {status}" for status, count in counts.items() if status != "ok")
        click.echo(f"  {name}: seen in {counts['ok']} of {total} frames{f' ({others})' if others else ''}")
    for note in () if done.placed is None else done.placed.notes:
        click.echo(f"  note: {note}")
    click.echo(f"  {done.path}")


def mechanism_of(path: Path) -> Mechanism:
    """Read a mechanism.toml, or a gripper.toml as both its halves."""
    if is_mechanism(path):
        return read_mechanism(path)
    gripper = read_gripper(path)
    return whole_mechanism(gripper, gripper, path.stem)
