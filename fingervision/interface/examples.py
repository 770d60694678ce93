"""Runnable examples: the files that the examples of a command's `--help` name, copied into a new folder."""

import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import fingervision
from fingervision.domain.errors import OutputError, UnknownNameError, UsageError
from fingervision.interface.argument_checks import path_of, speaks_python
from fingervision.storage.sample_folder import sample_folder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fingervision.domain.frame import Pixels


# Pictures of calibration targets, rendered when an example is copied, to keep the installation small.


SIZE_PX = (640, 480)
PX_PER_MM = 20.0
SEED = 1
TILTS_DEG = ((0.0, 0.0), (0.0, 14.0), (12.0, -6.0), (-10.0, 8.0), (-8.0, -12.0))
"""Tilts of the boards about both axes, in degrees; the first board lies in the plane of measurement."""
CAMERA_DISTANCE_PX = 2500.0
EXPOSURES = {"e05.png": 0.5, "e10.png": 1.0, "e20.png": 2.0, "e40.png": 4.0}


def board_pictures(folder: Path) -> None:
    """Draw a chessboard of 9x6 inner corners and a ChArUco board of 8x6 squares, flat and tilted."""
    import cv2

    from fingervision.rendering import Camera, Light, Patch, Scene, Tilt, render
    from fingervision.rendering.targets import chessboard

    rng = np.random.default_rng(SEED)
    squares = chessboard((9, 6), 2.5 * PX_PER_MM, x_px=320.0, y_px=240.0, turn_deg=2.0)
    scene = Scene(light=Light(ground=200.0), behind=(Patch(squares, 40.0),))
    for number, (about_x, about_y) in enumerate(TILTS_DEG):
        camera = Camera(noise_grey=1.0, tilt=Tilt(about_x, about_y, distance_px=CAMERA_DISTANCE_PX))
        _write(folder / ("plane.png" if number == 0 else f"tilted{number}.png"), render(scene, camera, rng))
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    drawn = np.asarray(cv2.aruco.CharucoBoard((8, 6), 3.0, 2.2, dictionary).generateImage((512, 384), None, 0, 1))
    for number, (about_x, about_y) in enumerate(TILTS_DEG):
        seen = cv2.warpPerspective(drawn, _view(drawn.shape, about_x, about_y), SIZE_PX, borderValue=255)
        noisy = cv2.GaussianBlur(seen, (0, 0), 0.8) * 0.7 + 20.0 + rng.standard_normal(seen.shape)
        name = "charuco_plane.png" if number == 0 else f"charuco_tilted{number}.png"
        _write(folder / name, np.rint(noisy).astype(np.uint8))


def exposures(folder: Path) -> None:
    """Draw fields of many shades at four exposures, by a camera whose response is a power law of 1/2.2."""
    rng = np.random.default_rng(SEED)
    scene = np.kron(rng.uniform(0.005, 0.5, (16, 20)), np.ones((24, 24)))
    for name, exposure in EXPOSURES.items():
        light = np.clip(scene * exposure + 1e-3 * rng.standard_normal(scene.shape), 0.0, 1.0)
        _write(folder / name, np.rint(255.0 * light ** (1.0 / 2.2)).astype(np.uint8))


def step_wedge(folder: Path) -> None:
    """Draw a step wedge of 20 fields with densities from 0.05 to 1.95, by the camera of `exposures`."""
    rng = np.random.default_rng(SEED)
    light = np.full((480, 640), 0.5)
    light[200:260, 40:600] = np.repeat(10.0 ** -np.arange(0.05, 2.0, 0.1), 28)
    light = np.clip(0.9 * light + 1e-3 * rng.standard_normal(light.shape), 0.0, 1.0)
    _write(folder / "wedge.png", np.rint(255.0 * light ** (1.0 / 2.2)).astype(np.uint8))


def micrometer(folder: Path) -> None:
    """Draw a line scale of 0.1 mm pitch with 34 pixels from line to line, rotated by one degree in the picture."""
    import cv2

    rng = np.random.default_rng(SEED)
    samples, (width, height), pitch_px, width_px = 4, (640, 300), 34.0, 8.0
    x = (np.arange(width * samples) + 0.5) / samples - 0.5 - 0.5 * width
    y = (np.arange(height * samples) + 0.5) / samples - 0.5 - 0.5 * height
    turn = np.radians(1.0)
    across = np.cos(turn) * x[None, :] + np.sin(turn) * y[:, None]
    along = -np.sin(turn) * x[None, :] + np.cos(turn) * y[:, None]
    away = np.abs(across - pitch_px * np.round(across / pitch_px)) - 0.5 * width_px
    covered = np.clip(0.5 - samples * away, 0.0, 1.0) * (np.abs(along) < 70.0)
    light = cv2.GaussianBlur(0.7 - 0.64 * covered, (0, 0), 0.9 * samples)
    light = light.reshape(height, samples, width, samples).mean(axis=(1, 3))
    noisy = light + 1.5 / 255.0 * rng.standard_normal(light.shape)
    _write(folder / "micrometer.png", np.rint(255.0 * np.clip(noisy, 0.0, 1.0)).astype(np.uint8))


def _view(shape: tuple[int, ...], about_x_deg: float, about_y_deg: float) -> "NDArray[np.float64]":
    """Homography of a drawn board that is tilted and centred in the picture."""
    a, b = np.radians(about_x_deg), np.radians(about_y_deg)
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), -np.sin(a)], [0.0, np.sin(a), np.cos(a)]])
    turn_y = np.array([[np.cos(b), 0.0, np.sin(b)], [0.0, 1.0, 0.0], [-np.sin(b), 0.0, np.cos(b)]])
    centred = np.array([[1.0, 0.0, -0.5 * shape[1]], [0.0, 1.0, -0.5 * shape[0]], [0.0, 0.0, 1.0]])
    placed = (turn_x @ turn_y)[:, :2] @ centred[:2]
    placed[2] = placed[2] / CAMERA_DISTANCE_PX + centred[2]
    middle = np.array([[1.0, 0.0, 0.5 * SIZE_PX[0]], [0.0, 1.0, 0.5 * SIZE_PX[1]], [0.0, 0.0, 1.0]])
    return np.asarray(middle @ placed)


def _write(path: Path, picture: "Pixels") -> None:
    import cv2

    path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


OWN = "own:"
"""Prefix of the source of a file that is inside the package, such as in `fingervision/examples`."""

PAPER_RUN = {"samples.csv": "paper_run/measured.csv", "comsol.csv": "paper_run/gripper.csv"}
PAPER = {"gripper.toml": "paper/gripper.toml"}
FRAMES = {f"frames/frame_{number:02}.png": f"table1/frame_{number:02}.png" for number in range(4, 9)}
OPENING = {"opening.mp4": "opening/opening.mp4", "calibration.json": "opening/calibration.json"}


@dataclass(frozen=True, slots=True)
class Case:
    """A runnable example: a folder of files on which the examples of a command's help can be run.

    Parameters
    ----------
    words : str
        Short description of the example.
    files : mapping of str to str
        Source of each file, by its name in the new folder: a path below the samples, or below the package if it begins
        with `OWN`.
    run : str
        The first command to run.
    made : tuple of callable
        Functions that draw further pictures into the folder.
    """

    words: str
    files: Mapping[str, str]
    run: str
    made: tuple[Callable[[Path], None], ...] = field(default=())


CASES = {
    "measure": Case(
        "the gap between two fingers in a video and in single pictures, joined with the stage's log",
        {
            **OPENING,
            "drive.csv": "opening/drive.csv",
            "gauges.toml": "opening/gauges.toml",
            **FRAMES,
        },
        "fingervision measure opening.mp4 --calibration calibration.json --drive drive.csv",
    ),
    "inspect": Case(
        "what limits a measurement, in plain words",
        {**OPENING, **FRAMES},
        "fingervision inspect opening.mp4 --px-per-mm 34",
    ),
    "calibrate": Case(
        "pixels to millimetres from bars, a slot, boards and a line scale; a check; repeatability",
        {
            "ref5.png": "reference/bar_05mm.png",
            "ref11.png": "reference/bar_11mm.png",
            "ref17.png": "reference/bar_17mm.png",
            "ref3.png": "reference/slot_03mm.png",
            "object.png": "reference/bar_08mm.png",
            "bar1.png": "reference/bar_02mm.png",
            "bar2.png": "reference/bar_08mm.png",
            "bar3.png": "reference/bar_14mm.png",
            "calibration.json": "reference/calibration.json",
            "opening.mp4": "opening/opening.mp4",
            **{
                f"{run}/gaps.csv": f"{OWN}examples/repeat/{run}.csv"
                for run in ("monday", "tuesday", "wednesday", "a", "b")
            },
        },
        "fingervision calibrate bar ref5.png=5.000 ref11.png=11.000 ref17.png=17.000 -o own.json",
        (board_pictures, exposures, micrometer, step_wedge),
    ),
    "compare": Case(
        "where a measured table and a simulation disagree",
        {**PAPER_RUN, **PAPER, "corrected/model.toml": f"{OWN}examples/diagnose/model.toml"},
        "fingervision compare samples.csv --model comsol.csv --out results",
    ),
    "diagnose": Case(
        "which effect a simulation lacks in comparison with a measured table",
        {
            **PAPER_RUN,
            **PAPER,
            "corrected/model.toml": f"{OWN}examples/diagnose/model.toml",
            "healthy.csv": PAPER_RUN["samples.csv"],
        },
        "fingervision diagnose samples.csv --model comsol.csv --out results",
    ),
    "model": Case(
        "gap, force, stress and vibration of a drawn gripper and of a drawn mechanism",
        {
            **PAPER,
            "drive.csv": f"{OWN}examples/model/drive.csv",
            "mechanism.toml": f"{OWN}models/mechanisms/parallel_leaf_stage.toml",
        },
        "fingervision model gripper.toml --kind all --drive drive.csv --out model",
    ),
    "bed": Case(
        "a recipe on the simulated test bed, with an effect hidden in it",
        {
            **{
                name: f"{OWN}examples/bed/{name}"
                for name in ("recipe.toml", "next_run.toml", "lab.toml", "sealed.toml", "steps.toml")
            },
            "gripper.csv": "paper_run/gripper.csv",
        },
        "fingervision bed run recipe.toml --hide sealed.toml --out run",
    ),
    "effects": Case(
        "an effect of one's own in a file, listed and diagnosed beside the catalogue",
        {"mine.py": f"{OWN}examples/effects/mine.py", **PAPER_RUN},
        "fingervision effects --effects ./mine.py",
    ),
    "table": Case(
        "tables of other programs, and how they are interpreted",
        {
            **{name: f"{OWN}examples/table/{name}" for name in ("stage.lvm", "comsol.txt", "log.csv")},
            "table1.csv": "paper/table1.csv",
        },
        "fingervision table stage.lvm",
    ),
    "batch": Case(
        "many recordings and many tables by one command",
        {
            "recordings/first/opening.mp4": "opening/opening.mp4",
            "recordings/second/opening.mp4": "opening/opening.mp4",
            "calibration.json": "opening/calibration.json",
            "drive.csv": "opening/drive.csv",
            "simulation.csv": "opening/simulation.csv",
            "runs.csv": f"{OWN}examples/batch/runs.csv",
            "runs/first/samples.csv": "paper_run/measured.csv",
            "runs/second/samples.csv": "paper_run/measured.csv",
            "comsol.csv": "paper_run/gripper.csv",
        },
        "fingervision batch measure 'recordings/**/*.mp4' --calibration calibration.json --out results",
    ),
    "paper": Case(
        "the paper's experiment of 17 inputs (Table 1), as pictures and as a run of the simulated bed",
        {
            **{f"table1/frame_{number:02}.png": f"table1/frame_{number:02}.png" for number in range(17)},
            "calibration.json": "table1/calibration.json",
            "recipe.toml": "paper_run/recipe.toml",
            "bed.toml": "paper_run/bed.toml",
            "gripper.csv": "paper_run/gripper.csv",
            **PAPER,
            "table1.csv": "paper/table1.csv",
        },
        "fingervision measure table1 --calibration calibration.json",
    ),
}
"""The examples by name; an example with the name of a command contains the files of the command's `--help` examples."""


def copy_example(name: str, folder: Path) -> Case:
    """Copy an example into a new folder.

    Parameters
    ----------
    name : str
        Name of the example.
    folder : Path
        The new folder; an existing folder must be empty.

    Raises
    ------
    UnknownNameError
        No example has that name.
    UsageError
        The folder exists and is not empty.
    OutputError
        The folder or a file in it cannot be written.
    """
    if name not in CASES:
        raise UnknownNameError("name", name, CASES, "one of the examples", "`fingervision example` lists them")
    case = CASES[name]
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"--out must be a new folder, but {folder} exists already: name another.")
    samples, package = sample_folder(), Path(fingervision.__file__).parent
    # The folder is created completely or not at all.
    part = folder.with_name(f".{folder.name}.part")
    try:
        for target, source in case.files.items():
            place = part / target
            place.parent.mkdir(parents=True, exist_ok=True)
            own = source.startswith(OWN)
            shutil.copyfile(package / source.removeprefix(OWN) if own else samples / source, place)
        for make in case.made:
            make(part)
        if folder.exists():
            folder.rmdir()
        part.replace(folder)
    except OSError as error:
        message = f"The example could not be copied to {folder} ({error.strerror}): name another folder with --out."
        raise OutputError(message) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return case


@speaks_python
def example(name: str, folder: "str | os.PathLike[str] | None" = None) -> Path:
    """Copy a runnable example (recordings, tables, drawings) into a new folder, and return the folder.

    Parameters
    ----------
    name : str
        Name of the example, such as measure; `fingervision example` lists them.
    folder : path or None
        The new folder; None takes example-NAME.

    Raises
    ------
    UnknownNameError
        No example has that name.
    OutputError, UsageError
        The folder is not empty, or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import fingervision as fv
    >>> sorted(path.name for path in fv.example("diagnose", tempfile.mkdtemp()).glob("*.csv"))
    ['comsol.csv', 'healthy.csv', 'samples.csv']
    """
    path = Path(f"example-{name}") if folder is None else path_of("folder", folder, "a folder")
    copy_example(name, path)
    return path
