"""Runnable examples: the files that the examples of a command's `--help` name, copied into a new folder."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import fingervision
from fingervision.domain.errors import OutputError, UnknownNameError, UsageError
from fingervision.interface.example_pictures import board_pictures, exposures, micrometer, step_wedge
from fingervision.storage.sample_folder import sample_folder

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


__all__ = ["CASES", "Case", "copy_example"]
