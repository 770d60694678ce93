"""`fingervision.bed`: a test bed, simulated or real, driven from Python as the commands `bed ...` drive it."""

import os
from collections.abc import Callable, Iterable
from math import inf
from pathlib import Path
from typing import Any, Self

from fingervision.domain.recipe import Recipe
from fingervision.interface.argument_checks import path_of, speaks_python
from fingervision.interface.progress import Bar, shown
from fingervision.measuring.rehearsal import rehearse
from fingervision.storage.recipe_toml import read_recipe
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import SIMULATED, open_bed
from fingervision.testbed.manual import manual_control
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.run.recipe_check import RecipeCheck, check_recipe, planned_bed
from fingervision.testbed.run.recipe_run import RunDone, run_recipe
from fingervision.testbed.run.run_folder import rows_before, times_of
from fingervision.testbed.simulation.injected_effects import hidden_from


class OpenBed:
    """A test bed whose parts are open; made by `fingervision.bed`, and closed at the end of its `with` block.

    Positions are millimetres from the reference; positive ones open the gripper.
    """

    def __init__(self, name: str, hide: Iterable[str], seed: int | None, after: Path | None, *, real_time: bool):
        self._name, self._hidden = name, hidden_from(tuple(hide))
        self._before = [] if after is None else rows_before(after)
        pace = 1.0 if real_time else 0.0
        self.bed: Bed = open_bed(name, self._hidden, pace=pace, seed=seed, earlier_s=times_of(self._before))

    def __enter__(self) -> Self:
        """Give the open test bed, which is closed when the `with` block is left."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the motor, and release all hardware."""
        self.close()

    def __repr__(self) -> str:
        low, high = self.limits.lower_mm, self.limits.upper_mm
        return f"OpenBed({self._name}, {low:g} to {high:g} mm)"

    def close(self) -> None:
        """Stop the motor first, then release all hardware."""
        self.bed.close()

    @property
    def limits(self) -> SoftLimits:
        """Limits of position, speed, force and gap, beyond which nothing is moved."""
        return self.bed.limits

    @property
    def position_mm(self) -> float:
        """Position of the stage, by its own latest reading."""
        return self.bed.actuator.readings()[-1].value

    @property
    def force_n(self) -> float | None:
        """Force at the drive (N); None without a force sensor."""
        return None if self.bed.force_sensor is None else self.bed.force_sensor.readings()[-1].value

    @speaks_python
    def home(self) -> float:
        """Move to the reference, which is position 0; return the position afterwards (mm)."""
        return manual_control.home(self.bed)

    @speaks_python
    def move(self, to_mm: float, speed_mm_s: float = 1.0) -> float:
        """Move to a position; return the position afterwards (mm).

        Raises
        ------
        DeviceError, LimitError, StateError
            The target or the speed is beyond a limit (nothing is moved), or the motion was interrupted.
        """
        return manual_control.move(self.bed, to_mm, speed_mm_s)

    @speaks_python
    def jog(self, speed_mm_s: float, seconds: float = inf) -> float:
        """Move at a signed speed (mm/s) for a time or to a limit; return the position afterwards (mm).

        Raises
        ------
        DeviceError, LimitError, StateError
            The speed is beyond a limit (nothing is moved), or the motion was interrupted.
        """
        return manual_control.jog(self.bed, speed_mm_s, seconds)

    def stop(self) -> None:
        """Stop the motor."""
        self.bed.actuator.stop()

    @speaks_python
    def check(self, recipe: "str | os.PathLike[str] | Recipe[Section]") -> RecipeCheck:
        """Plan a recipe without moving: its steps, its duration, and in `refusals` why the bed cannot run it."""
        return check_recipe(_recipe_of(recipe), planned_bed(self._name))

    @speaks_python
    def run(
        self,
        recipe: "str | os.PathLike[str] | Recipe[Section]",
        folder: "str | os.PathLike[str]",
        *,
        progress: Bar | bool | None = None,
        say: Callable[[str], Any] = lambda words: None,
    ) -> RunDone:
        """Run a recipe and measure every video frame; an interrupted run in the folder is continued.

        Parameters
        ----------
        recipe : path
            A recipe.toml; nothing moves before all of it is checked against the limits.
        folder : path
            Folder for the run: samples.csv, video, run.json, and the simulation if the bed has a model.
        progress : callable, bool or None
            Called with the seconds that are done and expected; True shows a bar on a terminal or in a notebook.
        say : callable
            Called with sentences on what happens.

        Returns
        -------
        RunDone
            The folder and the counts of frames; `table` is the measured table.

        Raises
        ------
        DeviceError, LimitError, StateError
            The run failed, or does not fit the bed; the motor is at rest, and the folder remains valid.
        """
        planned = _recipe_of(recipe)
        out = path_of("folder", folder, "a folder")
        if self.bed.replays:
            rehearse()
        with shown(progress, "Running", "s") as show:
            told: dict[str, Any] = {} if show is None else {"on_progress": show}
            return run_recipe(planned, self.bed, out, self._hidden, before=self._before, say=say, **told)


@speaks_python
def bed(
    name: "str | os.PathLike[str]" = SIMULATED,
    *,
    hide: str | Iterable[str] = (),
    seed: int | None = None,
    real_time: bool = False,
    after: "str | os.PathLike[str] | None" = None,
) -> OpenBed:
    """Open a test bed: actuator, force sensor, camera and gripper, each real or simulated.

    Parameters
    ----------
    name : path
        The word `simulated`, or the configuration file of a test bed (bed.toml).
    hide : str, or iterable of str
        Effects that act in the simulated parts, `EFFECT[:PARAMETER=VALUE,...]`, or a sealed file.
    seed : int or None
        Seed of all randomness in simulated parts; None takes that of the configuration.
    real_time : bool
        Whether a simulated test bed runs in real time instead of as fast as possible.
    after : path or None
        Folder of an earlier run on this test bed, which the next run continues.

    Raises
    ------
    DataError, DeviceError, InputFileError, UsageError
        The configuration is not valid, or a part cannot be opened.

    Examples
    --------
    The encoder of the simulated stage has steps of 0.03 mm:

    >>> import fingervision as fv
    >>> with fv.bed() as bed:
    ...     at_mm = bed.move(0.5)
    >>> print(f"{at_mm:.2f} mm")
    0.48 mm
    """
    words = (hide,) if isinstance(hide, str) else tuple(hide)
    earlier = None if after is None else path_of("after", after, "the folder of a run")
    return OpenBed(os.fspath(name), words, seed, earlier, real_time=real_time)


def _recipe_of(recipe: Any) -> Recipe[Section]:
    return recipe if isinstance(recipe, Recipe) else read_recipe(path_of("recipe", recipe, "a recipe.toml"))
