"""`fingervision compare`: where measurement and model disagree."""

from pathlib import Path

import click

from fingervision.cli._columns_option import columns_option
from fingervision.cli._effects_option import effects_option
from fingervision.cli._results_folder import results_folder
from fingervision.cli._which_model import kind_option, models_option, told_apart

EXAMPLES = """
\b
Examples:
  fingervision compare samples.csv --model comsol.csv --out results
  fingervision compare samples.csv --model gripper.toml
  fingervision compare samples.csv --model comsol.csv --model gripper.toml --out both
  fingervision compare samples.csv --model results/model.toml --json

\b
Files written to --out:
  compare.html   figures to zoom and read   compare.json  the same for programs
  gap_against_input, gap_over_time, residuals: figures as .svg and .pdf; compare.png
"""


@click.command(epilog=EXAMPLES)
@click.argument("measured", type=click.Path(path_type=Path))
@models_option
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("comparison"), show_default=True)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Of the bootstrapped threshold.")
@kind_option
@effects_option
@columns_option
@click.option("--json", "as_json", is_flag=True, help="Print compare.json.")
def command(
    measured: Path,
    model_paths: tuple[Path, ...],
    out: Path,
    seed: int,
    kind: str,
    columns: Path | None,
    as_json: bool,
) -> None:
    """Say where a measured table and one or more models disagree beyond the noise."""
    import json

    from fingervision.diagnosis.compare import compare
    from fingervision.diagnosis.report.comparison_files import PAGE, write_comparison
    from fingervision.storage.out_folder import new_out_folder, out_folder
    from fingervision.storage.provenance import provenance
    from fingervision.storage.result_owner import mark_owner
    from fingervision.tables.read import read_measured_table, read_model

    table = read_measured_table(measured, columns)
    models = {
        name: read_model(path, kind, columns) for name, path in zip(told_apart(model_paths), model_paths, strict=True)
    }
    out = results_folder(out, measured)
    with new_out_folder(out):
        compared = {name: compare(table, model, seed=seed) for name, model in models.items()}
    files = {"measured table": measured, **{f"model {name}": p for name, p in zip(models, model_paths, strict=True)}}
    with out_folder(out):
        document = write_comparison(out, compared, provenance(files), measured)
    mark_owner(out, measured)
    if as_json:
        click.echo(json.dumps(document, indent=2))
        return
    for name, found in compared.items():
        which = "" if len(compared) == 1 else f"{name}: "
        click.echo(f"{which}RMS disagreement {found.rms_mm:.3g} mm, noise {found.noise_mm:.2g} mm")
        for place in found.places:
            click.echo(f"  {place.words}")
        if not found.places:
            click.echo("  nowhere beyond the noise")
        for words in (*found.data.notes, *found.data.refitted()):
            click.echo(f"  note: {words}")
    click.echo(f"  {out / PAGE}")
