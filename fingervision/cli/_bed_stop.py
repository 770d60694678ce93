"""`fingervision bed stop`: stop the motor, even if another program drives it."""

import click

from fingervision.cli._on_bed import bed_option

EXAMPLES = """
\b
Examples:
  fingervision bed stop --bed lab.toml

\b
If another fingervision process drives this test bed, it is asked to stop the motor and to end. This command is no
emergency stop: that must be a separate circuit which disconnects the motor's supply, see
fingervision/testbed/firmware/README.md.
"""


@click.command(epilog=EXAMPLES)
@bed_option
def command(bed_name: str) -> None:
    """Stop the motor, even if another program drives it."""
    from fingervision.testbed.manual.stopping import stop_bed

    click.echo(stop_bed(bed_name))
