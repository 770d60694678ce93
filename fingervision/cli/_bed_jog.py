"""`fingervision bed jog`: move the stage at a given speed until stopped."""

import click

from fingervision.cli._number import NUMBER, Number
from fingervision.cli._on_bed import bed_option

EXAMPLES = """
\b
Examples:
  fingervision bed jog 0.5 --for-s 1
  fingervision bed jog -2 --bed lab.toml      until Ctrl-C, or the test bed's limit
"""


@click.command(epilog=EXAMPLES, context_settings={"ignore_unknown_options": True})
@click.argument("speed_mm_s", type=NUMBER)
@click.option("--for-s", type=Number(above=0.0), help="Stop after this many seconds.")
@click.option(
    "--home-first",
    is_flag=True,
    help="First search the reference position; relative step data need a known start position.",
)
@bed_option
def command(speed_mm_s: float, for_s: float | None, home_first: bool, bed_name: str) -> None:
    """Move the stage at SPEED_MM_S (mm/s) until stopped.

    A positive speed opens the gripper. The motion ends with Ctrl-C, after --for-s, or at a limit of the test bed.
    """
    from math import inf

    from fingervision.testbed.bed_factory import open_bed
    from fingervision.testbed.manual import manual_control

    bed = open_bed(bed_name, pace=1.0)
    try:
        if home_first:
            manual_control.home(bed)
        click.echo(f"jogged: {manual_control.jog(bed, speed_mm_s, inf if for_s is None else for_s):.3f} mm")
    finally:
        bed.close()
