"""`fingervision bed`: commands of the test bed: run and check recipes, move the stage by hand."""

from pathlib import Path

import click

from fingervision.cli._command import BED, FILE, NUMBER, OUTPUT, Group, Number, option
from fingervision.cli._options import (
    bed_option,
    effects_option,
    figure_option,
    hide_option,
    json_option,
    out_option,
    seed_option,
)

EXAMPLES = """
\b
Examples:
  fingervision bed run recipe.toml --out run
  fingervision bed run recipe.toml --hide backlash:play_mm=0.2 --out hidden
  fingervision bed run next_run.toml --bed lab.toml --out second
  fingervision bed check recipe.toml
  fingervision bed recipe
"""
RECIPE_EXAMPLES = """
\b
Examples:
  fingervision bed recipe
  fingervision bed recipe staircase

\b
  schema = 1                       A file of steps, executed one after another.
  below_force_n = 5.0              force at which the motor stops in any step; may be left out
  [[step]]
  kind = "triangle"                with the keys of this kind
"""
RUN_EXAMPLES = """
\b
Examples:
  fingervision bed run recipe.toml --out run
  fingervision bed run recipe.toml --hide backlash:play_mm=0.2 --hide camera_tilt --out hidden
  fingervision bed run recipe.toml --hide sealed.toml --out sealed
  fingervision bed run next_run.toml --after run --out second
  fingervision diagnose run/samples.csv --model run/simulation.csv --out diagnosis

\b
Files written to --out:
  samples.csv   one row per frame: input, gap, both edges, force    video.mp4     every frame, lossless (FFV1)
  run.json      recipe, test bed, clocks, digests                   events.jsonl  what happened, when
  recipe.toml   the recipe                                          simulation.csv the predicted gap

If a run was interrupted, for whatever reason, the same command continues it. On a terminal, p and Enter pauses and
resumes a run, q and Enter or Ctrl-C ends it; the motor is stopped first.
"""
CHECK_EXAMPLES = """
\b
Examples:
  fingervision bed check recipe.toml
  fingervision bed check next_run.toml --bed lab.toml
  fingervision bed check recipe.toml --json

No device is opened and nothing moves. The command runs no contract tests, which show whether a stage moves at
the commanded speed, stops, and refuses what it must. For a plug-in device, the command line of these tests is printed.
Exit codes: 0 the recipe fits the test bed; 1 it does not, with a message for each step that does not fit.
"""
MOVE_EXAMPLES = """
\b
Examples:
  fingervision bed move 1.25
  fingervision bed move -0.3 --speed-mm-s 0.5
  fingervision bed move 1.2 --speed-mm-s 20 --bed lab.toml

\b
A motor controller behind an Arduino board can only run its stored steps: it runs a step to that position, or repeated
relative steps, none of them faster than requested. Ctrl-C first stops the motor and then ends the command.
"""
JOG_EXAMPLES = """
\b
Examples:
  fingervision bed jog 0.5 --seconds 1
  fingervision bed jog -2 --bed lab.toml      until Ctrl-C, or the test bed's limit
"""
STEPS_EXAMPLES = """
\b
Examples:
  fingervision bed steps steps.toml
  fingervision bed steps steps.toml --figure steps.png
  fingervision bed steps steps.toml --run --bed lab.toml

\b
  schema = 1                       A file of 1 to 15 blocks, numbered in order.
  [[step]]
  target_mm = 5.0                  coordinates = "relative" counts from the present position
  load_kg = 0.2                    operation = "pushing" with pushing_force_n
  positioning_time_s = 0.2         or speed_mm_s, acceleration_mm_s2, deceleration_mm_s2
"""
HOME_EXAMPLES = """
\b
Examples:
  fingervision bed home --bed lab.toml
"""
STOP_EXAMPLES = """
\b
Examples:
  fingervision bed stop --bed lab.toml

\b
If another fingervision process has the stage's serial port open, it is asked to stop the motor and to end. Where it
speaks to the controller otherwise (over a network, or on Windows), end it first: two programs confuse a controller.
This command is no emergency stop: that must be a separate circuit which disconnects the motor's supply, see
fingervision/testbed/firmware/README.md.
"""


@click.group("bed", cls=Group, epilog=EXAMPLES)
def command() -> None:
    """Run the test bed: actuator, force sensor, camera and gripper, each real or simulated."""


home_first_option = option(
    "--home-first",
    is_flag=True,
    group=BED,
    help="First search the reference position; relative step data need a known start position.",
)


@command.command("run", epilog=RUN_EXAMPLES)
@click.argument("recipe_toml", metavar="RECIPE.toml", type=FILE)
@bed_option
@hide_option
@effects_option
@option(
    "--real-time", is_flag=True, group=BED, help="Run a simulated test bed in real time instead of as fast as possible."
)
@out_option("run")
@option(
    "--after",
    type=FILE,
    group=OUTPUT,
    help="Earlier run on this test bed; joined.csv then holds the rows of both runs.",
)
@json_option("Print the result of the run as JSON.")
@seed_option("Seed of all randomness in simulated parts; the same seed gives the same run.", None)
def run(
    recipe_toml: Path,
    bed_name: str,
    hide: tuple[str, ...],
    out: Path,
    after: Path | None,
    seed: int | None,
    real_time: bool,
    as_json: bool,
) -> None:
    """Run a recipe on the test bed and measure every video frame.

    The whole recipe is checked against the limits of the test bed before anything moves.
    """
    import json

    from fingervision.interface.bed import bed as opened
    from fingervision.storage.recipe_toml import read_recipe
    from fingervision.testbed.run.run_folder import interrupted

    recipe = read_recipe(recipe_toml)
    interrupted(out, recipe)
    with opened(bed_name, hide=hide, seed=seed, real_time=real_time, after=after) as bed:
        done = bed.run(recipe, out, progress=True, say=lambda words: click.echo(words, err=True))
    if as_json:
        counts = done.counts
        document = {"folder": str(done.folder), "frames": counts.recorded, "frames_with_gap": counts.with_gap}
        click.echo(json.dumps({**document, "frames_lost": counts.lost, "resumed_after": done.resumed_after}))
        return
    went_on = f", after {done.resumed_after} recorded before the interruption" if done.resumed_after else ""
    lost = f", {done.counts.lost} lost" if done.counts.lost else ""
    click.echo(
        f"{done.counts.recorded} frames{went_on}, {done.counts.with_gap} with a gap{lost}: {out / 'samples.csv'}"
    )
    if bed.bed.model is not None:
        click.echo(f"next: fingervision diagnose {done.table} --model {out / 'simulation.csv'} --out diagnosis")


@command.command("check", epilog=CHECK_EXAMPLES)
@click.argument("recipe_toml", metavar="RECIPE.toml", type=FILE)
@bed_option
@json_option("Print the check as JSON.")
def check(recipe_toml: Path, bed_name: str, as_json: bool) -> None:
    """Check a recipe without moving: positions, speeds, time, predicted gap and force, and the test bed's limits."""
    import json
    from dataclasses import asdict

    from fingervision.domain.errors import LimitError
    from fingervision.storage.recipe_toml import read_recipe
    from fingervision.testbed.motion.move_limits import ENDLESS_N
    from fingervision.testbed.run.recipe_check import CheckedStep, check_recipe, planned_bed

    def line(step: CheckedStep) -> str:
        gap = "" if step.gap_mm is None else f"{step.gap_mm[0]:z.3f} to {step.gap_mm[1]:z.3f}"
        force = "" if step.force_n is None else f"{step.force_n:.2f}"
        return (
            f"{step.number:>4}  {step.kind:<20} {step.from_mm:>z8.3f} {step.to_mm:>z8.3f} "
            f"{f'{step.lower_mm:z.3f} to {step.upper_mm:z.3f}':>18} {step.speed_mm_s:>7.3g} {step.seconds:>8.1f} "
            f"{gap:>16} {force:>6}"
        )

    recipe = read_recipe(recipe_toml)
    done = check_recipe(recipe, planned_bed(bed_name))
    limits = done.bed.limits
    if as_json:
        document = {
            "recipe": recipe.name, "bed": done.bed.name, "fits": not done.refusals, "seconds": done.seconds,
            "frames": done.frames, "frames_at_most": done.frames_at_most, "megabytes": done.megabytes,
            "limits": {key: value if abs(value) < float("inf") else None for key, value in asdict(limits).items()},
            "steps": [asdict(step) for step in done.steps],
        }  # fmt: skip
        click.echo(json.dumps(document))
    else:
        click.echo(f"{recipe.name} on {done.bed.name}, from the reference at 0 mm:")
        click.echo(
            f"step  {'kind':<20} {'from/mm':>8} {'to/mm':>8} {'range/mm':>18} {'mm/s':>7} {'time/s':>8} "
            f"{'gap/mm':>16} {'force/N':>6}"
        )
        for step in done.steps:
            click.echo(line(step).rstrip())
        most, settling_s = done.frames_at_most, done.bed.actuator.limits.settling_s
        frames = f"{done.frames} to {most}" if most > done.frames else f"{most}"
        click.echo(
            f"{len(done.steps)} steps, {done.seconds:.0f} s, {frames} recorded frames at {done.bed.rate_hz:g} Hz, "
            f"up to {done.megabytes:.0f} MB of lossless video"
        )
        if 0.0 < settling_s < float("inf"):
            click.echo(f"each motion may take longer by up to {settling_s:g} s (settling_s)")
        speed = "any speed" if limits.speed_mm_s == float("inf") else f"{limits.speed_mm_s:g} mm/s"
        force = "any force" if limits.force_n >= ENDLESS_N else f"{limits.force_n:g} N"
        click.echo(
            f"limits of the test bed: {limits.lower_mm:g} to {limits.upper_mm:g} mm, {speed}, {force}, "
            f"gap at least {limits.gap_mm:g} mm"
        )
    if done.refusals:
        raise LimitError("\n".join(done.refusals))
    if not as_json:
        for part in done.bed.plugged:
            click.echo(
                f"not tested: whether the {part.replace('_', ' ')} passes its contract tests; this command line runs "
                f"them{', and moves the stage' if part == 'actuator' else ''}:\n  {_contract_line(part, bed_name)}"
            )
        if not done.bed.is_simulated:
            shown = (
                "`bed run` stops if the gap moves 3 times as far as the model predicts, and warns of a third"
                if done.bed.model is not None
                else "no [gripper] states what the gap should do, so that nothing here shows it: measure one `bed move`"
            )
            click.echo(f"not tested: whether a millimetre of the stage is one (its units, and all limits): {shown}.")
        click.echo("The test bed can execute the recipe.")


def _contract_line(part: str, bed_name: str) -> str:
    """Command line that runs the contract tests of a device of a test bed."""
    import json
    from shlex import quote

    contract = "".join(word.title() for word in part.split("_")) + "Contract"
    program = (
        f"from fingervision.testing import {contract}, bed_at, run; "
        f'print(run({contract}, open_bed=lambda: bed_at({json.dumps(bed_name)})) or "keeps the contract")'
    )
    return f"python -c {quote(program)}"


@command.command("recipe", epilog=RECIPE_EXAMPLES)
@click.argument("kind", required=False)
def recipe(kind: str | None) -> None:
    """List the kinds of a recipe's steps with their keys, or only those of KIND."""
    from fingervision.domain.errors import UnknownNameError
    from fingervision.testbed.recipe_kinds import described, step_kinds

    if kind is not None and kind not in step_kinds():
        raise UnknownNameError("KIND", kind, step_kinds(), "a kind of step", f"there are {', '.join(step_kinds())}")
    click.echo("\n\n".join(described(each) for each in ([kind] if kind else step_kinds())))


@command.command("move", epilog=MOVE_EXAMPLES, context_settings={"ignore_unknown_options": True})
@click.argument("to_mm", type=NUMBER)
@option("--speed-mm-s", type=NUMBER, default=1.0, show_default=True, group=BED, help="Speed of the stage in mm/s.")
@home_first_option
@bed_option
def move(to_mm: float, speed_mm_s: float, home_first: bool, bed_name: str) -> None:
    """Move the stage to the position TO_MM; positive positions open the gripper.

    Nothing moves if the target is beyond the limits of the test bed.
    """
    from fingervision.interface.bed import bed as opened

    with opened(bed_name) as bed:
        if home_first:
            bed.home()
        click.echo(f"moved: {bed.move(to_mm, speed_mm_s):z.3f} mm")


@command.command("jog", epilog=JOG_EXAMPLES, context_settings={"ignore_unknown_options": True})
@click.argument("speed_mm_s", type=NUMBER)
@option("--seconds", type=Number(above=0.0), former=("--for-s",), group=BED, help="Stop after this many seconds.")
@home_first_option
@bed_option
def jog(speed_mm_s: float, seconds: float | None, home_first: bool, bed_name: str) -> None:
    """Move the stage at SPEED_MM_S (mm/s) until stopped.

    A positive speed opens the gripper. The motion ends with Ctrl-C, after --seconds, or at a limit of the test bed.
    """
    from math import inf

    from fingervision.interface.bed import bed as opened

    with opened(bed_name, real_time=True) as bed:
        if home_first:
            bed.home()
        click.echo(f"jogged: {bed.jog(speed_mm_s, inf if seconds is None else seconds):z.3f} mm")


@command.command("steps", epilog=STEPS_EXAMPLES)
@click.argument("steps_toml", metavar="STEPS.toml", type=FILE)
@option(
    "--run", "run_them", is_flag=True, group=BED, help="Search the reference, then run the sequence on the test bed."
)
@bed_option
@figure_option("Plot position and speed over time.", "--plot")
def steps(steps_toml: Path, figure: Path | None, run_them: bool, bed_name: str) -> None:
    """Show or run the step data of a motor controller (motions that it stores by number).

    The steps are checked against the limits of the published stage (10 mm, 400 mm/s, 5.5 N), or of the stage of the
    test bed's configuration.
    """
    from fingervision.storage.recipe_toml import read_steps
    from fingervision.testbed.manual.step_running import run_sequence, step_limits, steps_table
    from fingervision.testbed.motion.step_checks import planned_sequence

    data, limits = read_steps(steps_toml), step_limits(bed_name)
    motions = planned_sequence(data, limits)
    click.echo(steps_table(motions))
    if figure is not None:
        from fingervision.testbed.manual.step_running import draw_steps

        draw_steps(figure, data.name, motions, limits)
        click.echo(f"plot: {figure}")
    if run_them:
        run_sequence(data, bed_name, say=click.echo)


@command.command("home", epilog=HOME_EXAMPLES)
@bed_option
def home(bed_name: str) -> None:
    """Move the stage to its reference, position 0.

    This also resets an earlier motor stop.
    """
    from fingervision.interface.bed import bed as opened

    with opened(bed_name) as bed:
        click.echo(f"homed: {bed.home():z.3f} mm")


@command.command("stop", epilog=STOP_EXAMPLES)
@bed_option
def stop(bed_name: str) -> None:
    """Stop the motor, even if another program drives it."""
    from fingervision.testbed.manual.manual_control import stop_bed

    click.echo(stop_bed(bed_name))
