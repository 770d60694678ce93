"""Run a recipe on a test bed: plan it, check it, execute it, record it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.recipe import Recipe
from fingervision.measuring.rehearsal import rehearse
from fingervision.storage.samples_csv import SampleRow
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import Bed
from fingervision.testbed.run.controls import Controls
from fingervision.testbed.run.plan import Plan, plan
from fingervision.testbed.run.plan_feasibility import check_moves
from fingervision.testbed.run.plan_runner import Progress, Runner
from fingervision.testbed.run.run_folder import BedRunFolder
from fingervision.testbed.run.run_record import Counts, OnRow, RunRecord
from fingervision.testbed.run.safety_monitor import Say, Watch
from fingervision.testbed.run.synchronised_acquisition import Sight
from fingervision.testbed.simulation.injected_effects import NOTHING, Hidden


@dataclass(frozen=True, slots=True)
class RunDone:
    """Result of a completed run.

    Parameters
    ----------
    folder : Path
        Folder with the run's files.
    counts : Counts
        Number of frames by status.
    resumed_after : int
        Number of frames recorded before an interruption; 0 for a new run.
    """

    folder: Path
    counts: Counts
    resumed_after: int


def run_recipe(
    recipe: Recipe[Section],
    bed: Bed,
    out: Path,
    hidden: Hidden = NOTHING,
    *,
    before: Sequence[SampleRow] = (),
    controls: Controls | None = None,
    on_progress: Progress = lambda done, total: None,
    say: Say = lambda words: None,
    on_plan: Callable[[Plan], None] = lambda planned: None,
    on_row: OnRow = lambda row, picture: None,
) -> RunDone:
    """Run a recipe; nothing moves before it is checked against the limits and both fingers are visible.

    Parameters
    ----------
    recipe : Recipe
        The recipe.
    bed : Bed
        The test bed; it is left open.
    out : Path
        Folder for the run; an interrupted run in it is continued.
    hidden : Hidden
        Effects injected into the test bed.
    before : sequence of SampleRow
        Rows of an earlier run on this test bed, whose numbering and clock this run continues.
    controls : Controls, optional
        Controls for pause and stop.
    on_progress, say, on_plan, on_row : callable
        Called with: seconds done and expected; sentences; the plan before it is executed; every row as it is written,
        with its picture.

    Raises
    ------
    FingervisionError
        The run failed; the motor is at rest, and the folder remains valid.
    """
    if not bed.replays:
        # Compile the measuring functions now: at the first frame, compilation could block all threads for longer than
        # the board runs its motor without a message.
        rehearse()
    sight = Sight(bed)
    sight.position.read()
    # A real stage is homed before the first motion segment.
    at_mm = sight.position.newest if bed.replays else 0.0
    planned = plan(recipe, bed.limits, bed.model, at_mm, sight.rate_hz, sight.width_mm)
    check_moves(planned, bed.actuator, bed.limits, at_mm)
    on_plan(planned)
    folder = BedRunFolder(out, recipe, bed, hidden, before)
    try:
        size_px = (sight.camera.description.width_px, sight.camera.description.height_px)
        left = max(sum(planned.seconds) * sight.rate_hz - len(folder.rows), 0.0)
        folder.needs_room(left, size_px)
        record = RunRecord(folder, lambda bed_s, at_once: sight.position.at(bed_s, at_once=at_once), on_row)
        watch = Watch(bed, sight, record, controls or Controls(), recipe.below_force_n, say)
        runner = Runner(planned, watch, on_progress)
        if before:
            runner.follow(before[-1])
        counts = runner.execute()
        folder.finish(runner.found())
    except BaseException as error:
        folder.break_off(str(error) or type(error).__name__)
        raise
    return RunDone(out, counts, len(folder.rows))
