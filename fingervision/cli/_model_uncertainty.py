"""Results of `fingervision model` with their uncertainties, if the drawing states uncertainties of its dimensions."""

import csv
from collections.abc import Mapping
from pathlib import Path

import click
from matplotlib.figure import Figure

from fingervision.domain.with_uncertainty import with_uncertainty
from fingervision.models.gripper_figures import unit_of
from fingervision.models.kinds import by_trust
from fingervision.models.uncertainty import FigureUncertainty

_LEFT_OUT = ("peak_x_mm", "peak_y_mm", "lowest_input_mm", "highest_input_mm")
_HEADER = ("kind", "figure", "unit", "value", "u", "method", "low_95", "high_95", "first", "first_share", "second",
           "second_share", "third", "third_share")  # fmt: skip
_DRAWN = (
    "gap_per_input",
    "input_stiffness_n_mm",
    "peak_stress_mpa_per_mm",
    "input_at_yield_mm",
    "first_mode_drive_free_hz",
    "first_mode_drive_held_hz",
    "contact_input_mm",
    "mechanical_advantage",
)


def write_uncertainty(
    found: Mapping[str, FigureUncertainty], rows: Mapping[str, Mapping[str, float | None]], name: str, out: Path,
    *, as_json: bool,
) -> None:  # fmt: skip
    """Write uncertainty.csv and uncertainty.png, and print the most accurate model's results and main contributions.

    Parameters
    ----------
    found : mapping of str to FigureUncertainty
        Uncertainty of every result, by the name of the result.
    rows : mapping of str to mapping
        Results of every kind of model, written beside the uncertainties.
    name : str
        Name of the mechanism.
    out : Path
        Folder to write to.
    as_json : bool
        Whether the output is JSON, so that this function prints nothing.
    """
    with (out / "uncertainty.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_HEADER)
        for kind, row in rows.items():
            for figure, own in _stated(found, row).items():
                value = float(row[figure] or 0.0)
                low, high = (value + end - own.value for end in own.interval)
                cells = [kind, figure, unit_of(figure), *(f"{x:.6g}" for x in (value, own.u)), _method(own)]
                cells += [f"{low:.6g}", f"{high:.6g}"]
                cells += [part for n, share in own.shares for part in (n, f"{share:.3f}")]
                writer.writerow(cells + [""] * (len(_HEADER) - len(cells)))
    best = by_trust(rows)[0]
    stated = _stated(found, rows[best])
    _draw(stated, rows[best], f"{name}: {best}", out / "uncertainty.png")
    if as_json:
        return
    click.echo(f"Standard uncertainties of the results, caused by the uncertain numbers of the drawing ({best}):")
    width = max((len(figure) for figure in stated), default=0) + 2
    for figure, own in stated.items():
        most = ", ".join(f"{n} {100.0 * share:.0f} %" for n, share in own.shares if share >= 0.005)
        words = f"{with_uncertainty(float(rows[best][figure] or 0.0), own.u)} {unit_of(figure)}"
        click.echo(f"  {figure:<{width}}{words:<34}{_method(own):<9}{most}")


def _stated(found: Mapping[str, FigureUncertainty], row: Mapping[str, float | None]) -> dict[str, FigureUncertainty]:
    return {f: own for f, own in found.items() if f not in _LEFT_OUT and row.get(f) is not None}


def _method(own: FigureUncertainty) -> str:
    return "sampled" if own.sampled else "linear"


def _draw(stated: Mapping[str, FigureUncertainty], row: Mapping[str, float | None], title: str, path: Path) -> None:
    """Plot, for the main results, the contribution of each dimension to the variance."""
    names = [figure for figure in _DRAWN if figure in stated] or list(stated)[: len(_DRAWN)]
    inputs = list(dict.fromkeys(n for figure in names for n, _ in stated[figure].shares))
    figure = Figure(figsize=(9.0, 1.6 + 0.5 * max(len(names), 1)), layout="constrained")
    axes = figure.add_subplot()
    for place, name in enumerate(names):
        left = 0.0
        for n, share in stated[name].shares:
            axes.barh(place, 100.0 * share, left=left, color=f"C{inputs.index(n)}")
            left += 100.0 * share
    for place, n in enumerate(inputs):
        axes.barh(0, 0.0, color=f"C{place}", label=n)
    labels = [f"{n}\n{with_uncertainty(float(row[n] or 0.0), stated[n].u)} {unit_of(n)}" for n in names]
    axes.set_yticks(range(len(names)), labels, fontsize="small")
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("share of the variance by the three numbers that contribute most / %")
    axes.set_title(f"{title}, standard uncertainties", fontsize="medium")
    if inputs:
        axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=130)
