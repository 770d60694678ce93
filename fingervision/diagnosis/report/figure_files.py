"""The plots of a report as files: gap against input, gap over time and residuals, each as SVG and PDF."""

from pathlib import Path

from matplotlib.figure import Figure

from fingervision.diagnosis.report.gap_curves import GapCurves
from fingervision.diagnosis.report.gap_figures import gap_against_input, gap_over_time
from fingervision.diagnosis.report.vector_figure import FORMATS, write_vector

INPUT, TIME, RESIDUALS = "gap_against_input", "gap_over_time", "residuals"


def write_figures(out: Path, curves: GapCurves, residuals: Figure, title: str, *, prefix: str = "") -> tuple[Path, ...]:
    """Write the plots into a folder, replacing earlier ones.

    Parameters
    ----------
    out : Path
        An existing folder.
    curves : GapCurves
        Measurement and predictions.
    residuals : Figure
        Plot of measured minus predicted values.
    title : str
        Title of the plots.
    prefix : str
        Beginning of the file names, so that two commands can write to one folder.
    """
    over_time = gap_over_time(curves, title)
    if over_time is None:
        for kind in FORMATS:
            (out / f"{prefix}{TIME}.{kind}").unlink(missing_ok=True)
    figures = {INPUT: gap_against_input(curves, title), TIME: over_time, RESIDUALS: residuals}
    return tuple(
        path
        for name, figure in figures.items()
        if figure is not None
        for path in write_vector(figure, out / f"{prefix}{name}")
    )
