"""`fingervision diagnose`: name the missing effect, add it to the model, and compare before and after."""

from pathlib import Path

import click

from fingervision.cli._command import FILE, MODEL, make_command, option
from fingervision.cli._options import (
    columns_option,
    complete_effect,
    effects_option,
    json_option,
    kind_option,
    model_option,
    names_of,
    names_option,
    out_option,
    results_folder,
    running_command,
    seed_option,
    title_option,
)

EXAMPLES = """
\b
Examples:
  fingervision diagnose samples.csv --model comsol.csv --out results
  fingervision diagnose samples.csv --model results/model.toml --out again
  fingervision diagnose samples.csv --model gripper.toml --kind finite_element
  fingervision diagnose samples.csv --model comsol.csv --without lens_distortion --json
  fingervision diagnose samples.csv --reference healthy.csv --model gripper.toml --out changes

\b
Files written to --out:
  report.html   the result on one page       report.json   the same as data
  model.toml    the corrected model          next_run.toml recipe of a run that separates what is ambiguous
  gap_against_input (170 mm wide), gap_against_input_85mm, gap_over_time, residuals: plots for a paper as .svg and .pdf
With --reference, instead of these:
  changes.json   what changed, and where         changes.svg   the drawing, coloured by the evidence
"""

COLOURS, DOUBTFUL = {"agrees": "green", "named": "cyan"}, "yellow"
"""Colours of a verdict in a terminal."""


@make_command(EXAMPLES)
@click.argument("measured", type=FILE)
@model_option
@kind_option
@option(
    "--reference",
    type=FILE,
    group=MODEL,
    help="Table of the same specimen while it was healthy: say what changed since, and at which hinge.",
)
@option(
    "--with",
    "forced",
    multiple=True,
    metavar="EFFECT",
    shell_complete=complete_effect,
    group=MODEL,
    help="Include this effect in every explanation.",
)
@option(
    "--without",
    multiple=True,
    metavar="EFFECT",
    shell_complete=complete_effect,
    group=MODEL,
    help="Exclude this effect from every explanation.",
)
@effects_option
@columns_option
@out_option("diagnosis")
@title_option
@names_option
@json_option("Print report.json.")
@seed_option("Seed of the bootstrap; the same seed gives the same report.")
def command(
    measured: Path,
    model_path: Path,
    out: Path,
    reference: Path | None,
    forced: tuple[str, ...],
    without: tuple[str, ...],
    seed: int,
    kind: str,
    columns: Path | None,
    title: str,
    names: tuple[str, ...],
    as_json: bool,
) -> None:
    """Identify the physical effect that a model lacks, by comparing the model with a measured table."""
    import json

    if reference is not None:
        if forced or without:
            raise click.UsageError("--with and --without name effects, and cannot be given together with --reference.")
        _changes(measured, reference, model_path, out, kind, columns, as_json=as_json)
        return
    from fingervision.diagnosis.report.answer_files import PAGE
    from fingervision.interface.diagnosis import diagnose
    from fingervision.storage.out_folder import new_out_folder

    out = results_folder(out, measured)
    with new_out_folder(out):
        done = diagnose(
            measured,
            model_path,
            with_effects=forced,
            without_effects=without,
            seed=seed,
            kind=kind,
            columns=columns,
            progress=True,
            call=running_command(),
        )
    document = done.write(out, title, names_of([model_path], names).get(model_path, ""))
    if as_json:
        click.echo(json.dumps(document, indent=2))
        return
    verdict, colon, rest = done.sentences().partition(":")
    click.echo(f"{click.style(verdict, bold=True, fg=COLOURS.get(verdict, DOUBTFUL))}{colon}{rest}\n  {out / PAGE}")


def _changes(
    measured: Path, reference: Path, model: Path, out: Path, kind: str, columns: Path | None, *, as_json: bool
) -> None:
    """Compare with a healthy recording, and print what changed."""
    import json

    from fingervision.interface.healthy_reference import CHANGES, changes_since
    from fingervision.storage.out_folder import new_out_folder

    out = results_folder(out, measured)
    with new_out_folder(out):
        done = changes_since(measured, reference, model, kind=kind, columns=columns, call=running_command())
        document = done.write(out)
    click.echo(json.dumps(document, indent=2) if as_json else f"{done.sentences()}\n  {out / CHANGES}")
