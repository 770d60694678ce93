"""`fingervision bed check`: motions and duration of a recipe, and whether the test bed can execute it."""

from pathlib import Path

import click

from fingervision.cli._on_bed import bed_option

EXAMPLES = """
\b
Examples:
  fingervision bed check recipe.toml
  fingervision bed check next_run.toml --bed lab.toml
  fingervision bed check recipe.toml --json

No device is opened and nothing moves. The command runs no contract tests, which show whether a stage moves at
the commanded speed, stops, and refuses what it must. For a plug-in device, the command line of these tests is printed.
Exit codes: 0 the recipe fits the test bed; 1 it does not, with a message for each step that does not fit.
"""


@click.command(epilog=EXAMPLES)
@click.argument("recipe_toml", metavar="RECIPE.toml", type=click.Path(path_type=Path))
@bed_option
@click.option("--json", "as_json", is_flag=True, help="Print the check as JSON.")
def command(recipe_toml: Path, bed_name: str, as_json: bool) -> None:
    """Check a recipe without moving: positions, speeds, time, predicted gap and force, and the test bed's limits."""
    import json
    from dataclasses import asdict

    from fingervision.domain.errors import LimitError
    from fingervision.storage.recipe_toml import read_recipe
    from fingervision.testbed.planned_bed import planned_bed
    from fingervision.testbed.run.recipe_check import CheckedStep, check_recipe

    def line(step: CheckedStep) -> str:
        gap = "" if step.gap_mm is None else f"{step.gap_mm[0]:.3f} to {step.gap_mm[1]:.3f}"
        force = "" if step.force_n is None else f"{step.force_n:.2f}"
        return (
            f"{step.number:>4}  {step.kind:<20} {step.from_mm:>8.3f} {step.to_mm:>8.3f} "
            f"{f'{step.lower_mm:.3f} to {step.upper_mm:.3f}':>18} {step.speed_mm_s:>7.3g} {step.seconds:>8.1f} "
            f"{gap:>16} {force:>6}"
        )

    recipe = read_recipe(recipe_toml)
    done = check_recipe(recipe, planned_bed(bed_name))
    limits = done.bed.limits
    if as_json:
        document = {
            "recipe": recipe.name, "bed": done.bed.name, "fits": not done.refusals, "seconds": done.seconds,
            "frames": done.frames, "megabytes": done.megabytes,
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
        click.echo(
            f"{len(done.steps)} steps, {done.seconds:.0f} s, {done.frames} frames at {done.bed.rate_hz:g} Hz, up to "
            f"{done.megabytes:.0f} MB of lossless video"
        )
        speed = "any speed" if limits.speed_mm_s == float("inf") else f"{limits.speed_mm_s:g} mm/s"
        click.echo(
            f"limits of the test bed: {limits.lower_mm:g} to {limits.upper_mm:g} mm, {speed}, {limits.force_n:g} N, "
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
