"""`fingervision measure --mechanism`: measure the poses of a mechanism's bodies in a recording."""

from collections.abc import Callable
from pathlib import Path

import click

from fingervision.frames.source import FrameSource
from fingervision.measuring.body_poses import measure_bodies
from fingervision.measuring.drawing_placement import parse_point
from fingervision.measuring.frame_loop import coded, prepared
from fingervision.measuring.task import Task, task_for_frames
from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.mechanism import Mechanism
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import is_mechanism, read_mechanism


def body_follower(drawing: Path, points: tuple[str, ...]) -> Callable[[FrameSource, Task, Path, bool], None]:
    """Read a drawing and the points that place it; return the object that measures its bodies in a recording.

    Raises
    ------
    DataError, InputFileError, UsageError
        The drawing cannot be read, or a point has the wrong form.
    """
    mechanism, given = mechanism_of(drawing), [parse_point(text) for text in points]

    def follow(source: FrameSource, task: Task, folder: Path, as_json: bool) -> None:
        """Write bodies.csv, and print in how many frames each body was found."""
        task = task_for_frames(task, source.description)
        how = prepared(source.description, task)
        frames = coded(source, how.description.coding)
        done = measure_bodies(frames, mechanism, task.scale, given, folder, how.settings)
        if as_json:
            return
        for name, counts in done.counts.items():
            total = sum(counts.values())
            others = ", ".join(f"{count} {status}" for status, count in counts.items() if status != "ok")
            click.echo(f"  {name}: seen in {counts['ok']} of {total} frames{f' ({others})' if others else ''}")
        for note in () if done.placed is None else done.placed.notes:
            click.echo(f"  note: {note}")
        click.echo(f"  {done.path}")

    return follow


def mechanism_of(path: Path) -> Mechanism:
    """Read a mechanism.toml, or a gripper.toml as a mechanism of its two halves."""
    if is_mechanism(path):
        return read_mechanism(path)
    gripper = read_gripper(path)
    return whole_mechanism(gripper, gripper, path.stem)
