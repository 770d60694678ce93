"""`fingervision bed home`: move the stage to its reference position, which becomes position 0."""

import click

from fingervision.cli._on_bed import bed_option

EXAMPLES = """
\b
Examples:
  fingervision bed home --bed lab.toml
"""


@click.command(epilog=EXAMPLES)
@bed_option
def command(bed_name: str) -> None:
    """Move the stage to its reference, position 0.

    This also resets an earlier motor stop.
    """
    from fingervision.testbed.bed_factory import open_bed
    from fingervision.testbed.manual import manual_control

    bed = open_bed(bed_name)
    try:
        click.echo(f"homed: {manual_control.home(bed):.3f} mm")
    finally:
        bed.close()
