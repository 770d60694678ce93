"""`fingervision demo`: run the complete procedure on the simulated test bed, and print one line for each part of it."""

from pathlib import Path

import click

from fingervision.cli._command import make_command
from fingervision.cli._options import effects_option, hide_option, out_option, seed_option

EXAMPLES = """
\b
Examples:
  fingervision demo
  fingervision demo --hide backlash:play_mm=0.15 --out backlash
  fingervision demo --seed 5 --out shown
"""
UNSEPARATED = "one of several explanations that no proposed run separates"


@make_command(EXAMPLES)
@hide_option
@effects_option
@out_option("demo")
@seed_option("Seed of all randomness; without --hide, it also chooses the hidden effect.")
def command(hide: tuple[str, ...], seed: int, out: Path) -> None:
    """Add an effect to the simulated test bed, run a recipe, measure its video, and identify the added effect.

    If several explanations remain after the first run, the proposed next run is executed as well.
    """
    from fingervision.demonstration.demonstrate import demonstrate, drawn
    from fingervision.testbed.simulation.injected_effects import hidden_from

    hidden = hidden_from(hide) if hide else drawn(seed)
    click.echo("An effect is hidden in the simulated test bed; its name is shown at the end.")
    shown = demonstrate(hidden, seed, out, click.echo)
    truth = " and ".join(
        f"{name} ({', '.join(f'{key} = {value:.4g}' for key, value in values.items())})"
        for name, values in hidden.effects.items()
    )
    ending = "found" if shown.found else UNSEPARATED if shown.among else "not found"
    runs = "one run" if shown.runs == 1 else f"{shown.runs} runs"
    click.echo(f"Hidden effect: {truth or 'none'}. It was {ending} after {runs}.")
    click.echo(f"Report: {shown.page}")
