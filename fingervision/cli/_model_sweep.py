"""`fingervision model --vary`: a table and a plot over numbers of the drawing."""

import json
from pathlib import Path

import click
import numpy as np
from matplotlib.figure import Figure

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.parameter_sweep import COLUMNS, parse_variation, sweep_answers

_LABELS = (
    "gap per input / (mm/mm)",
    "force per input / (N/mm)",
    "largest stress per input / (MPa/mm)",
    "input at yield / mm",
)
_MOST_ROWS_PRINTED = 40


def sweep(
    gripper: Gripper, name: str, texts: tuple[str, ...], theory: HingeTheory, out: Path, *, as_json: bool
) -> None:
    """Write vary.csv and vary.png, and print the table."""
    variations = [parse_variation(text) for text in texts]
    values, answers = sweep_answers(gripper, variations, theory)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FingervisionError(f"--out must be a folder that can be written, but {out}: {error.strerror}.") from error
    header = [*(variation.name for variation in variations), *COLUMNS]
    table = np.concatenate([values, answers], axis=1)
    lines = [",".join(header), *(",".join(f"{v:.7g}" if np.isfinite(v) else "" for v in row) for row in table)]
    (out / "vary.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    figure.suptitle(f"{name}: lumped model over {variations[-1].name}")
    last = variations[-1].values
    others = values[:: len(last), :-1]
    for place, (axes, label) in enumerate(zip(figure.subplots(2, 2, sharex=True).ravel(), _LABELS, strict=True)):
        for row, other in enumerate(others):
            curve = answers[row * len(last) : (row + 1) * len(last), place]
            axes.plot(last, curve, marker=".", label=", ".join(f"{v:.4g}" for v in other) or None)
        axes.set_ylabel(label)
        axes.set_xlabel(variations[-1].name)
        axes.grid(alpha=0.3)
    if len(variations) > 1 and len(others) <= 12:
        axes.legend(title=", ".join(v.name for v in variations[:-1]), fontsize="x-small")
    figure.savefig(out / "vary.png", dpi=130)
    if as_json:
        rows = [
            {k: (v if np.isfinite(v) else None) for k, v in zip(header, row, strict=True)} for row in table.tolist()
        ]
        click.echo(json.dumps(rows, indent=2))
        return
    widths = [max(len(text), 10) for text in header]
    click.echo("  ".join(f"{text:>{width}}" for text, width in zip(header, widths, strict=True)))
    for row in table[:_MOST_ROWS_PRINTED].tolist():
        click.echo("  ".join(f"{value:>{width}.5g}" for value, width in zip(row, widths, strict=True)))
    if len(table) > _MOST_ROWS_PRINTED:
        click.echo(f"... {len(table) - _MOST_ROWS_PRINTED} more rows in {out / 'vary.csv'}")
