"""Correction for side walls, which widen the inner flanks of both fingers but not the outer flanks."""

import numpy as np

from fingervision.vision.blur_uncertainty import Displacement
from fingervision.vision.edge_moves import are_of_size, beyond_wall, moved_by_wall, moved_edges, with_blur
from fingervision.vision.edges import EdgePoints
from fingervision.vision.flank_fits import Flank, best_fit
from fingervision.vision.levelled_profile import levelled, u_squared_width
from fingervision.vision.mean_profile import MeanProfile
from fingervision.vision.profile_models import STEP, WALL
from fingervision.vision.wall_width import SURE, WIDER

# Least reduction of chi-square by a wall, compared with a step.
SIGNIFICANT = 30.0
# Relative standard uncertainties of a correction for a wall: the first because a wall's tone is not exactly uniform;
# the second if only the width of the flanks indicates the wall, so that two standard uncertainties include no wall.
U_WALL, U_HIDDEN_WALL = 0.1, 0.5


def with_narrow_wall(
    edges: EdgePoints,
    inner: list[Flank],
    outer: list[MeanProfile],
    enough: float,
    is_outline: bool,
    displaced_px: Displacement,
) -> EdgePoints | None:
    """Edges corrected for side walls that widen the inner flanks; None if the outer flanks are equally wide.

    Motion and defocus widen the outer flanks as well. Only the width of the flanks indicates a wall narrower than the
    blur; the correction for such a wall has half of its value as standard uncertainty.
    """
    inside, widths, wide, u_more = [], [], [], []
    for (profile, weight, blur), beyond, by_codec in zip(inner, outer, displaced_px(edges), strict=True):
        own, other = levelled(profile, blur), levelled(beyond, blur)
        inside.append((own, weight, blur))
        wide.append(best_fit(STEP, own, weight, blur))
        widths.append(best_fit(STEP, other, weight, blur).blur)
        u_own, u_other = (u_squared_width(p, weight, blur, by_codec) for p in (own, other))
        u_more.append(float(np.hypot(u_own, u_other)))
    more = [step.blur**2 - width**2 for step, width in zip(wide, widths, strict=True)]
    if any(each < max(WIDER * width**2, SURE * u) for each, width, u in zip(more, widths, u_more, strict=True)):
        return None
    narrow = [best_fit(WALL, own, weight, width, True) for (own, weight, _), width in zip(inside, widths, strict=True)]
    remains = sum(fit.squares for fit in narrow)
    if remains > enough or not are_of_size(narrow, -1.0):
        return None
    is_shown = remains < sum(step.squares for step in wide) - SIGNIFICANT
    chosen = [beyond_wall(fit) for fit in narrow] if is_outline else narrow
    return with_blur(
        moved_edges(edges, chosen, U_WALL if is_shown else U_HIDDEN_WALL, moved_by_wall(edges), "wall"), widths
    )
