"""`fingervision bed move`: move the stage to a given position."""

import click

from fingervision.cli._number import NUMBER
from fingervision.cli._on_bed import bed_option

EXAMPLES = """
\b
Examples:
  fingervision bed move 1.25
  fingervision bed move -0.3 --speed-mm-s 0.5
  fingervision bed move 1.2 --speed-mm-s 20 --bed lab.toml

\b
A motor controller behind an Arduino board can only run its stored steps: it runs a step to that position, or repeated
relative steps, none of them faster than requested. Ctrl-C first stops the motor and then ends the command.
"""


@click.command(epilog=EXAMPLES, context_settings={"ignore_unknown_options": True})
@click.argument("to_mm", type=NUMBER)
@click.option("--speed-mm-s", type=NUMBER, default=1.0, show_default=True, help="Speed of the stage in mm/s.")
@click.option(
    "--home-first",
    is_flag=True,
    help="First search the reference position; relative step data need a known start position.",
)
@bed_option
def command(to_mm: float, speed_mm_s: float, home_first: bool, bed_name: str) -> None:
    """Move the stage to the position TO_MM; positive positions open the gripper.

    Nothing moves if the target is beyond the limits of the test bed.
    """
    from fingervision.testbed.bed_factory import open_bed
    from fingervision.testbed.manual import manual_control

    bed = open_bed(bed_name)
    try:
        if home_first:
            manual_control.home(bed)
        click.echo(f"moved: {manual_control.move(bed, to_mm, speed_mm_s):.3f} mm")
    finally:
        bed.close()
