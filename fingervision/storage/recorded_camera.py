"""The camera's settings of a recorded run, from the run.json beside its video."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from fingervision.storage.plain_file import json_of
from fingervision.storage.run_files import RUN


def recorded_camera(files: Sequence[Path]) -> Mapping[str, str]:
    """Read the camera's settings at the time of a recording.

    Parameters
    ----------
    files : sequence of Path
        Files of which the recording consists.

    Returns
    -------
    mapping of str to str
        Settings by name; empty if no run.json mentions this recording.
    """
    if len(files) != 1:
        return {}
    try:
        run = json_of(files[0].parent / RUN)
        camera = run["device"]["camera"] if run["video"] == files[0].name else {}
    except (OSError, ValueError, LookupError, TypeError):
        return {}  # there is no run.json, or it belongs to something else
    return {str(name): str(value) for name, value in camera.items()} if isinstance(camera, dict) else {}
