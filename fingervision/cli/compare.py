"""`fingervision compare`: find where measurement and model disagree."""

from pathlib import Path

import click

from fingervision.cli._command import FILE, make_command
from fingervision.cli._options import (
    columns_option,
    effects_option,
    json_option,
    kind_option,
    models_option,
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
  fingervision compare samples.csv --model comsol.csv --out results
  fingervision compare samples.csv --model gripper.toml
  fingervision compare samples.csv --model comsol.csv --model gripper.toml --out both
  fingervision compare samples.csv --model corrected/model.toml --json
  fingervision compare samples.csv --model comsol.csv --name comsol.csv="finite elements" --title "Gripper 3"

\b
Files written to --out:
  compare.html   plots to zoom and read    compare.json  the same as data
  compare_gap_against_input (170 mm wide), compare_gap_against_input_85mm, compare_gap_over_time, compare_residuals:
                 plots for a paper as .svg and .pdf
  compare.png    the residuals
"""


@make_command(EXAMPLES)
@click.argument("measured", type=FILE)
@models_option
@kind_option
@effects_option
@columns_option
@out_option("comparison")
@title_option
@names_option
@json_option("Print compare.json.")
@seed_option("Seed of the bootstrap for the threshold.")
def command(
    measured: Path,
    model_paths: tuple[Path, ...],
    out: Path,
    seed: int,
    kind: str,
    columns: Path | None,
    title: str,
    names: tuple[str, ...],
    as_json: bool,
) -> None:
    """Say where a measured table disagrees with one or more models by more than the noise."""
    import json

    from fingervision.diagnosis.report.comparison_files import PAGE
    from fingervision.interface.comparison import compare
    from fingervision.interface.tables import told_apart
    from fingervision.storage.out_folder import new_out_folder

    out = results_folder(out, measured)
    named, short = names_of(model_paths, names), told_apart(list(model_paths))
    models = {named.get(path, words): path for words, path in zip(short, model_paths, strict=True)}
    if len(models) < len(short):
        raise click.UsageError("--name must give each model words of its own, but two models have the same.")
    with new_out_folder(out):
        found = compare(measured, models, seed=seed, kind=kind, columns=columns, call=running_command())
    found.write(out, title)
    click.echo(json.dumps(found.document(), indent=2) if as_json else f"{found.report()}\n  {out / PAGE}")
