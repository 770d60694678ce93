"""`fingervision compare`: where measurement and model disagree."""

from pathlib import Path

import click

from fingervision.cli._which_model import kind_option, model_option

EXAMPLES = """
\b
Examples:
  fingervision compare samples.csv --model comsol.csv --out results
  fingervision compare samples.csv --model gripper.toml
  fingervision compare samples.csv --model results/model.toml --json

\b
Files written to --out: compare.json, compare.png
"""


@click.command(epilog=EXAMPLES)
@click.argument("measured", type=click.Path(path_type=Path))
@model_option
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("comparison"), show_default=True)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Of the bootstrapped threshold.")
@kind_option
@click.option("--json", "as_json", is_flag=True, help="Print compare.json.")
def command(measured: Path, model_path: Path, out: Path, seed: int, kind: str, as_json: bool) -> None:
    """Say where a measured table and a model disagree beyond the noise."""
    import json

    from fingervision.diagnosis.compare import compare
    from fingervision.diagnosis.report.residual_figure import residual_figure
    from fingervision.storage.measured_table import read_measured_table
    from fingervision.storage.model_toml import read_model
    from fingervision.storage.out_folder import new_out_folder, out_folder

    table, model = read_measured_table(measured), read_model(model_path, kind)
    with new_out_folder(out):
        found = compare(table, model, seed=seed)
    document = found.document()
    with out_folder(out):
        (out / "compare.json").write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
        (out / "compare.png").write_bytes(residual_figure(found.residual_mm, None, found.data.chain.history))
    if as_json:
        click.echo(json.dumps(document, indent=2))
        return
    click.echo(f"RMS disagreement {found.rms_mm:.3g} mm, noise {found.noise_mm:.2g} mm")
    for place in found.places:
        click.echo(f"  {place.words}")
    if not found.places:
        click.echo("  nowhere beyond the noise")
    for words in (*found.data.notes, *found.data.refitted()):
        click.echo(f"  note: {words}")
