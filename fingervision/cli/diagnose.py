"""`fingervision diagnose`: name the missing effect, add it to the model, and compare before and after."""

from pathlib import Path

import click

from fingervision.cli._columns_option import columns_option
from fingervision.cli._effects_option import effects_option
from fingervision.cli._results_folder import results_folder, running_command
from fingervision.cli._which_model import kind_option, model_option

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
  gap_against_input, gap_over_time, residuals: plots as .svg and .pdf
With --reference, instead of these:
  changes.json   what changed, and where         changes.svg   the drawing, coloured by the evidence
"""


@click.command(epilog=EXAMPLES)
@click.argument("measured", type=click.Path(path_type=Path))
@model_option
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("diagnosis"),
    show_default=True,
    help="Folder for the results.",
)
@click.option(
    "--reference",
    type=click.Path(path_type=Path),
    help="Table of the same specimen while it was healthy: say what changed since, and at which hinge.",
)
@click.option("--with", "forced", multiple=True, metavar="EFFECT", help="Include this effect in every explanation.")
@click.option("--without", multiple=True, metavar="EFFECT", help="Exclude this effect from every explanation.")
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=1,
    show_default=True,
    help="Seed of the bootstrap; the same seed gives the same report.",
)
@kind_option
@effects_option
@columns_option
@click.option("--json", "as_json", is_flag=True, help="Print report.json.")
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
    document = done.write(out)
    click.echo(json.dumps(document, indent=2) if as_json else f"{done.sentences()}\n  {out / PAGE}")


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
