"""`fingervision bed steps`: show step data as a table and a plot, and execute them on a test bed."""

from pathlib import Path

import click

from fingervision.cli._on_bed import bed_option

EXAMPLES = """
\b
Examples:
  fingervision bed steps steps.toml
  fingervision bed steps steps.toml --plot steps.png
  fingervision bed steps steps.toml --run --bed lab.toml

\b
  schema = 1                       A file of 1 to 15 blocks, numbered in order.
  [[step]]
  target_mm = 5.0                  coordinates = "relative" counts from the present position
  load_kg = 0.2                    operation = "pushing" with pushing_force_n
  positioning_time_s = 0.2         or speed_mm_s, acceleration_mm_s2, deceleration_mm_s2
"""


@click.command(epilog=EXAMPLES)
@click.argument("steps_toml", metavar="STEPS.toml", type=click.Path(path_type=Path))
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False), help="Plot position and speed over time.")
@click.option("--run", "run_them", is_flag=True, help="Search the reference, then run the sequence on the test bed.")
@bed_option
def command(steps_toml: Path, plot: Path | None, run_them: bool, bed_name: str) -> None:
    """Show or run the step data of a motor controller (motions that it stores by number).

    The steps are checked against the limits of the published stage (10 mm, 400 mm/s, 5.5 N), or of the stage of the
    test bed's configuration.
    """
    from fingervision.storage.steps_toml import read_steps
    from fingervision.testbed.manual.step_running import run_sequence, step_limits
    from fingervision.testbed.manual.steps_table import steps_table
    from fingervision.testbed.motion.step_checks import planned_sequence

    data, limits = read_steps(steps_toml), step_limits(bed_name)
    motions = planned_sequence(data, limits)
    click.echo(steps_table(motions))
    if plot is not None:
        from fingervision.testbed.manual.steps_figure import draw_steps

        draw_steps(plot, data.name, motions, limits)
        click.echo(f"plot: {plot}")
    if run_them:
        run_sequence(data, bed_name, say=click.echo)
