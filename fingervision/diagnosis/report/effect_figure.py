"""Plot of an effect's residual: an ideal linear gripper is opened, held and closed, with and without the effect."""

import numpy as np
from matplotlib.figure import Figure

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.report.residual_figure import residual_figure
from fingervision.domain.effect import History
from fingervision.effects import catalogue
from fingervision.models.table import TableModel

SHOWN_SHARE = 0.2
"""Size of the parameters in the plot, as a share of their range, so that the shape is clearly visible."""


def effect_figure(name: str) -> Figure:
    """Draw the residual that an effect causes."""
    effect = catalogue()[name]
    input_mm = np.array([-0.6, 1.6])
    gap_mm = 4.0 + 7.7 * input_mm
    model = TableModel("straight", input_mm, -0.5 * gap_mm, 0.5 * gap_mm, 2.0 * input_mm)
    up, hold = np.linspace(-0.5, 1.5, 200), np.full(100, 1.5)
    u = np.concatenate([up, hold, up[::-1], np.full(100, -0.5), up[:120], up[120:60:-1]])
    history = History(
        input_mm=u,
        time_s=np.arange(u.size, dtype=np.float64) * np.float64(0.05),
        runs=(slice(0, u.size),),
        rest_gap_mm=4.0,
        opening_mm=float(np.max(np.abs(7.7 * u))),
        closing_mm=3.85,
        force=True,
    )
    searched = effect.search(history)
    values = {}
    for p in effect.parameters if isinstance(searched, str) else searched:
        if p.name in effect.drawn_with:
            values[p.name] = effect.drawn_with[p.name]
        elif p.logarithmic or p.reciprocal:
            values[p.name] = float(np.sqrt(max(p.lower, 1e-2 * p.upper) * p.upper))
        else:
            values[p.name] = p.upper * SHOWN_SHARE if p.neutral is not None else 0.5 * (p.lower + p.upper)
    chain = MeasuringChain(model, history, {})
    bare, with_it = chain.respond({}), chain.respond({name: values})
    if effect.needs_force:
        return residual_figure({"force": 1.0 * (np.asarray(with_it.force_n) - np.asarray(bare.force_n))}, None, history)
    residual = {
        "gap": with_it.gap_mm - bare.gap_mm,
        "left": with_it.left_mm - bare.left_mm,
        "right": with_it.right_mm - bare.right_mm,
    }
    return residual_figure(residual, None, history)
