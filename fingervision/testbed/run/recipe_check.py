"""Check a recipe against a test bed without opening hardware: motions, duration, and impossible steps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from fingervision.domain.errors import FingervisionError
from fingervision.domain.model import Model
from fingervision.domain.recipe import Recipe
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import MoveCheck
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import (
    gripper_model,
    limits_within,
    open_bed,
    stated_limits,
    stated_parts,
    stated_scale,
)
from fingervision.testbed.device_kinds import PluggedKind
from fingervision.testbed.motion.move_limits import SLACK_MM, SoftLimits
from fingervision.testbed.recipe_kinds import Leg
from fingervision.testbed.run.plan import check_moves, frames_of, legs_of, plan
from fingervision.testbed.run.run_folder import BYTES_PER_PX

CAMERA_PX, CAMERA_HZ = (640, 480), 25.0
"""Size and frame rate of a camera whose section states none: those of the published test bed."""


@dataclass(frozen=True, slots=True, eq=False)
class PlannedBed:
    """The test bed against which a recipe is checked.

    Parameters
    ----------
    name : str
        Name of the test bed.
    limits : SoftLimits
        Soft limits of position, speed, force and gap.
    actuator : MoveCheck
        Motions that the stage can make.
    model : Model or None
        Model of the gripper: gap and force at each position.
    rate_hz : float
        Frames per second.
    size_px : (int, int)
        Width and height of the pictures.
    px_per_mm : float or None
        Scale of the camera; None if the configuration states none.
    is_simulated : bool
        Whether every part is simulated.
    plugged : tuple of str
        Devices (`actuator`, `force_sensor`, `camera`) whose kind is a file or comes from another distribution.
    """

    name: str
    limits: SoftLimits
    actuator: MoveCheck
    model: Model | None
    rate_hz: float
    size_px: tuple[int, int]
    px_per_mm: float | None
    is_simulated: bool
    plugged: tuple[str, ...] = ()

    @property
    def view_mm(self) -> float:
        """Width of the camera's view (mm); infinite if the scale is unknown."""
        return float("inf") if self.px_per_mm is None else self.size_px[0] / self.px_per_mm


def planned_bed(name: str) -> PlannedBed:
    """Read a test bed's configuration for planning; hardware is neither opened nor moved.

    Parameters
    ----------
    name : str
        `simulated`, or the path of a configuration file.

    Raises
    ------
    DataError, InputFileError, UsageError
        The configuration is not valid, or its kind of actuator does not state its limits without hardware.
    """
    top, sections, kinds = stated_parts(name)
    plugged = tuple(part for part, kind in kinds.items() if isinstance(kind, PluggedKind))
    if all(kind.SIMULATED for kind in kinds.values()):
        bed = open_bed(name)
        try:
            return _of(bed, top, plugged)
        finally:
            bed.close()
    folder, kind = top.path.parent, kinds["actuator"]
    describe = getattr(kind, "without_hardware", None)
    if describe is None:
        sections["actuator"].refuse(
            "kind",
            "must state its limits without its hardware, but has no function without_hardware(section, folder): add "
            "this function to its file, or let `bed run` check the recipe at its start.",
        )
    actuator: MoveCheck = describe(sections["actuator"], folder)
    scale = stated_scale(top.table("scale"), folder)
    camera = sections.get("camera", top.table("camera"))
    return PlannedBed(
        name=name,
        limits=limits_within(stated_limits(top.table("limits")), actuator.limits, top.table("limits")),
        actuator=actuator,
        model=gripper_model(top.table("gripper"), folder) if "gripper" in top.values else None,
        rate_hz=camera.number("rate_hz", CAMERA_HZ, above=0.0),
        size_px=(
            camera.whole("width_px", CAMERA_PX[0], low=16, high=16384),
            camera.whole("height_px", CAMERA_PX[1], low=16, high=16384),
        ),
        px_per_mm=None if scale is None else scale.px_per_mm,
        is_simulated=False,
        plugged=plugged,
    )


def _of(bed: Bed, top: Section, plugged: tuple[str, ...]) -> PlannedBed:
    if bed.camera is None:
        top.refuse(None, "must have a [camera], but has none: add it with its kind.")
    described = bed.camera.description
    return PlannedBed(
        name=str(bed.about["name"]),
        limits=bed.limits,
        actuator=bed.actuator,
        model=bed.model,
        rate_hz=described.rate_hz or CAMERA_HZ,
        size_px=(described.width_px, described.height_px),
        px_per_mm=None if bed.scale is None else bed.scale.px_per_mm,
        is_simulated=True,
        plugged=plugged,
    )


POSITIONS = 41
"""Positions along a step's path at which gap and force are predicted; between them, grippers are nearly linear."""


@dataclass(frozen=True, slots=True)
class CheckedStep:
    """One step of a recipe, as the test bed would execute it.

    Parameters
    ----------
    number : int
        Number of the step, from 1.
    kind : str
        Kind of the step.
    from_mm, to_mm : float
        Position of the stage before the step, and after it.
    lower_mm, upper_mm : float
        Smallest and largest position during the step.
    speed_mm_s : float
        Highest speed; 0 without a motion.
    seconds : float
        Expected duration.
    gap_mm : (float, float) or None
        Smallest and largest gap predicted by the gripper model; None without a model.
    force_n : float or None
        Largest predicted drive force; None if the model predicts no force.
    refusal : str or None
        Sentence with which the test bed refuses the step; None if the step is possible.
    """

    number: int
    kind: str
    from_mm: float
    to_mm: float
    lower_mm: float
    upper_mm: float
    speed_mm_s: float
    seconds: float
    gap_mm: tuple[float, float] | None
    force_n: float | None
    refusal: str | None


@dataclass(frozen=True, slots=True)
class RecipeCheck:
    """Result of checking a recipe against a test bed.

    Parameters
    ----------
    bed : PlannedBed
        The test bed.
    steps : tuple of CheckedStep
        Steps in order.
    seconds : float
        Expected duration of all steps.
    frames, frames_at_most : int
        Number of frames that the run records, and that it records if each motion takes the stage's whole settling time.
    megabytes : float
        Space that their lossless video may need.
    """

    bed: PlannedBed
    steps: tuple[CheckedStep, ...]
    seconds: float
    frames: int
    frames_at_most: int
    megabytes: float

    @property
    def refusals(self) -> tuple[str, ...]:
        """Reasons why the test bed refuses the recipe; empty if it can be run."""
        return tuple(step.refusal for step in self.steps if step.refusal is not None)


def check_recipe(recipe: Recipe[Section], bed: PlannedBed) -> RecipeCheck:
    """Plan a recipe step by step; if a step is refused, the following steps are checked nevertheless.

    Parameters
    ----------
    recipe : Recipe
        The recipe as read from its file.
    bed : PlannedBed
        Test bed against which the recipe is checked.
    """
    at_mm = 0.0
    steps: list[CheckedStep] = []
    legs: list[Leg] = []
    for number, section in enumerate(recipe.steps, start=1):
        refusal = None
        try:
            planned = plan(replace(recipe, steps=(section,)), bed.limits, bed.model, at_mm, bed.rate_hz, bed.view_mm)
            check_moves(planned, bed.actuator, bed.limits, at_mm)
        except FingervisionError as error:
            refusal = str(error)
        try:
            own = tuple(legs_of(number, section, at_mm, bed.limits, bed.rate_hz))
        except FingervisionError:
            # The settings of the step are not valid, so that there is no motion to describe.
            own = ()
        steps.append(_described(number, section, own, at_mm, bed, refusal))
        legs += own
        at_mm = steps[-1].to_mm
    settling_s = bed.actuator.limits.settling_s
    # A screw that is turned by hand takes the time that it takes, in which no frame is recorded.
    frames, at_most = frames_of(legs, bed.rate_hz, settling_s if isfinite(settling_s) else 0.0)
    megabytes = at_most * bed.size_px[0] * bed.size_px[1] * BYTES_PER_PX / 1e6
    return RecipeCheck(bed, tuple(steps), sum(step.seconds for step in steps), frames, at_most, megabytes)


def _described(
    number: int, section: Section, legs: Sequence[Leg], at_mm: float, bed: PlannedBed, refusal: str | None
) -> CheckedStep:
    to_mm = legs[-1].end_mm if legs else at_mm
    reached = [at_mm, *(mm for leg in legs for mm in (leg.end_mm, *leg.reached_mm))]
    # Beyond the limits, predictions of the gripper's model are meaningless, because the test bed does not go there.
    within = bed.limits.lower_mm - SLACK_MM <= min(reached) and max(reached) <= bed.limits.upper_mm + SLACK_MM
    gap_mm, force_n = _foretold(min(reached), max(reached), bed) if within and refusal is None else (None, None)
    return CheckedStep(
        number=number,
        kind=str(section.values.get("kind", "?")),
        from_mm=at_mm,
        to_mm=to_mm,
        lower_mm=min(reached),
        upper_mm=max(reached),
        speed_mm_s=max((leg.speed_mm_s for leg in legs), default=0.0),
        seconds=sum(leg.seconds for leg in legs),
        gap_mm=gap_mm,
        force_n=force_n,
        refusal=refusal,
    )


def _foretold(lower_mm: float, upper_mm: float, bed: PlannedBed) -> tuple[tuple[float, float] | None, float | None]:
    """Gap and force that the model predicts over a motion; None if the model's range does not include the motion."""
    if bed.model is None:
        return None, None
    try:
        answer = bed.model.respond(np.linspace(lower_mm, upper_mm, POSITIONS))
    except FingervisionError:
        return None, None
    force_n = None if answer.force_n is None else float(np.abs(answer.force_n).max())
    return (float(answer.gap_mm.min()), float(answer.gap_mm.max())), force_n
