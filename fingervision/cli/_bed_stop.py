"""`fingervision bed stop`: stop the motor, whichever program moves it."""

import click

from fingervision.cli._on_bed import bed_option

EXAMPLES = """
\b
Examples:
  fingervision bed stop --bed lab.toml

\b
Another fingervision that drives this bed is asked to end; its motor stops first. This is no emergency stop: that is a
circuit of its own which takes the motor's supply away, see fingervision/testbed/firmware/README.md.
"""


@click.command(epilog=EXAMPLES)
@bed_option
def command(bed_name: str) -> None:
    """Stop the motor, whoever drives it."""
    from fingervision.testbed.manual.stopping import stop_bed

    click.echo(stop_bed(bed_name))
