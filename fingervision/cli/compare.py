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
    out_option,
    results_folder,
    running_command,
    seed_option,
)

EXAMPLES = """
\b
Examples:
  fingervision compare samples.csv --model comsol.csv --out results
  fingervision compare samples.csv --model gripper.toml
  fingervision compare samples.csv --model comsol.csv --model gripper.toml --out both
  fingervision compare samples.csv --model corrected/model.toml --json

\b
Files written to --out:
  compare.html   plots to zoom and read    compare.json  the same as data
  compare_gap_against_input, compare_gap_over_time, compare_residuals: plots as .svg and .pdf
  compare.png    the residuals
"""


@make_command(EXAMPLES)
@click.argument("measured", type=FILE)
@models_option
@kind_option
@effects_option
@columns_option
@out_option("comparison")
@json_option("Print compare.json.")
@seed_option("Seed of the bootstrap for the threshold.")
def command(
    measured: Path,
    model_paths: tuple[Path, ...],
    out: Path,
    seed: int,
    kind: str,
    columns: Path | None,
    as_json: bool,
) -> None:
    """Say where a measured table disagrees with one or more models by more than the noise."""
    import json

    from fingervision.diagnosis.report.comparison_files import PAGE
    from fingervision.interface.comparison import compare
    from fingervision.storage.out_folder import new_out_folder

    out = results_folder(out, measured)
    with new_out_folder(out):
        found = compare(measured, list(model_paths), seed=seed, kind=kind, columns=columns, call=running_command())
    found.write(out)
    click.echo(json.dumps(found.document(), indent=2) if as_json else f"{found.report()}\n  {out / PAGE}")
