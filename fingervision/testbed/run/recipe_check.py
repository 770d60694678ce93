"""Check a recipe against a test bed without operating it: motions, duration, and impossible steps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.errors import FingervisionError
from fingervision.domain.recipe import Recipe
from fingervision.storage.toml_section import Section
from fingervision.testbed.planned_bed import PlannedBed
from fingervision.testbed.run.motion_segments import Leg
from fingervision.testbed.run.plan import SLACK_MM, check_moves, frames_of, legs_of, plan
from fingervision.testbed.run.run_folder import BYTES_PER_PX

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
    frames, at_most = frames_of(legs, bed.rate_hz, bed.actuator.limits.settling_s)
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
