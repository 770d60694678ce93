"""Stored levels of background and fingers, and how much of them is clipped at the ends of the scale."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.inspection.look import Look
from fingervision.inspection.sample import Sample
from fingervision.vision.profile_lines import INNER

Floats = NDArray[np.float64]

# Width (pixels) of the strip in which plateaus are read, and its distance from the inner edge as a multiple of the
# blur.
STRIP_PX, BEYOND_BLURS = 6, 3.0
# Share of clipped pixels above which a plateau counts as clipped; about half of the noise distribution is then beyond
# the end of the scale.
AT_END_SHARE = 0.25


@dataclass(frozen=True, slots=True)
class Plateaus:
    """Levels beside the inner edges, as fractions of full scale.

    Parameters
    ----------
    bright, dark : float
        Levels of the brighter plateau (background, or light fingers) and of the darker one.
    at_top, at_zero : float
        Share of the brighter plateau's pixels at the upper end of the scale, and of the darker plateau's at zero.
    """

    bright: float
    dark: float
    at_top: float
    at_zero: float

    @property
    def is_cut(self) -> bool:
        """Whether the levels of the background or of a finger are clipped."""
        return self.at_top > AT_END_SHARE or self.at_zero > AT_END_SHARE


def plateaus(sample: Sample) -> Plateaus:
    """Read the levels of background and fingers beside both inner edges in every inspected frame."""
    response, top = sample.settings.response, sample.top_level
    found = [_of(look, top, response.cut_off_at(look.upright, top)) for look in sample.looks]
    return Plateaus(*(float(np.median([each[k] for each in found])) for k in range(4)))


def _of(look: Look, top: int, cut_off_at: int) -> tuple[float, float, float, float]:
    outside: list[Floats] = []
    inside: list[Floats] = []
    edges = look.edges
    start = int(np.ceil(BEYOND_BLURS * look.flank_blur_px)) + 1
    for side in range(2):
        real = np.flatnonzero(edges.lines.weight[side, :INNER] > 0)
        if not real.size:
            continue
        rows = edges.lines.fixed[side, real].astype(int)
        at = np.rint(edges.position[side, real]).astype(int)
        outward = int(edges.lines.outward[side, real[0]])
        for sense, strip in ((outward, outside), (-outward, inside)):
            columns = at[:, None] + sense * np.arange(start, start + STRIP_PX)
            use = (columns >= 0) & (columns < look.upright.shape[1])
            levels = look.upright[np.broadcast_to(rows[:, None], columns.shape)[use], columns[use]]
            strip.append(levels.astype(np.float64))
    if not outside or not sum(part.size for part in outside) or not sum(part.size for part in inside):
        return (float(look.upright.max()) / top, float(look.upright.min()) / top, 0.0, 0.0)
    out, ins = np.concatenate(outside), np.concatenate(inside)
    bright, dark = (out, ins) if np.median(out) > np.median(ins) else (ins, out)
    return (
        float(np.median(bright)) / top,
        float(np.median(dark)) / top,
        float(np.mean(bright >= cut_off_at)),
        float(np.mean(dark <= 0)),
    )
