"""`fingervision effects`: list the catalogue of effects, one line each, or explain one effect with a plot."""

from pathlib import Path

import click

from fingervision.cli._command import make_command
from fingervision.cli._options import complete_effect, effects_option, figure_option
from fingervision.domain.errors import UnknownNameError, UsageError

EXAMPLES = """
\b
Examples:
  fingervision effects
  fingervision effects backlash
  fingervision effects backlash --figure backlash.png
"""


@make_command(EXAMPLES)
@click.argument("name", required=False, shell_complete=complete_effect)
@effects_option
@figure_option("Plot the residual that the effect causes.")
def command(name: str | None, figure: Path | None) -> None:
    """List the physical effects, or explain the effect NAME."""
    from fingervision.effects import catalogue, origin_of

    if name is None:
        if figure is not None:
            raise UsageError("--figure needs the name of an effect, but none is given: add the name.")
        for effect in catalogue().values():
            origin = origin_of(effect.name)
            click.echo(
                f"{effect.name:22} {effect.stage!s:10} {effect.words}{'' if origin.built_in else f' [{origin}]'}"
            )
        return
    if name not in catalogue():
        raise UnknownNameError("NAME", name, catalogue(), "an effect", "`fingervision effects` lists them")
    effect = catalogue()[name]
    needs = [
        words
        for needed, words in (
            (effect.needs_times, "times"),
            (effect.needs_shared_clock, "a clock shared by all runs"),
            (effect.needs_edges, "left and right"),
            (effect.needs_force, "a force"),
        )
        if needed
    ]
    click.echo(f"{effect.name} ({effect.stage}): {effect.words}\n")
    click.echo(f"  law       {effect.formula}\n  source    {effect.source}\n  residual  {effect.residual}")
    click.echo(
        f"  needs     {', '.join(needs) or 'input and gap'}{'; starts each run at rest' if effect.memory else ''}"
    )
    place = f"{effect.order:g}" if effect.order < float("inf") else "last"
    click.echo(
        f"  order     {place}, in the section {effect.stage} of the measuring chain\n  from      {origin_of(name)}"
    )
    for p in effect.parameters:
        click.echo(f"  {p.words}: {p.name}, {p.unit or 'ratio'}, {p.lower:g} to {p.upper:g}, narrowed by the data")
    if figure is not None:
        from fingervision.diagnosis.report.figure_files import effect_figure
        from fingervision.diagnosis.report.vector_figure import png_bytes

        figure.write_bytes(png_bytes(effect_figure(name)))
        click.echo(f"  picture   {figure}")
