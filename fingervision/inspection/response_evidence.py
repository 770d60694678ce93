"""Evidence for the camera response from the shape of edges: optics blur an edge symmetrically in light, not in levels.

Each inner flank is fitted by a symmetrically blurred step, once in the light of the assumed response and once in that
of the alternative response. The likelihood ratio of the two fits gives the probability of the alternative response. An
optical aberration (coma) skews the edges of both fingers to the same side of the picture, whereas a wrong response
skews each edge towards its dark side, so that the two flanks together distinguish the aberration from a wrong response.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.inspection.flank_profile import FlankProfile, flank_profile
from fingervision.inspection.profile_fit import fit_step
from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage, top_level
from fingervision.vision.pipeline import Settings
from fingervision.vision.wall_width import WIDER

Floats = NDArray[np.float64]

# Larger values (2 ln of the likelihood ratio) are limited to this value, which is practically certainty.
LARGEST_ODDS = 60.0
# Smallest standard uncertainty of a bin, as a share of the contrast, because optics and lossy codecs do not blur
# exactly symmetrically: for pictures stored without loss, and with loss.
MODEL_SHARE, LOSSY_SHARE = 0.001, 0.03
# The camera sharpens after its transfer curve, which makes edges symmetric in the stored levels. The shape of an edge
# is therefore not used if it overshoots a plateau by this share of the contrast, and by this number of standard
# deviations of the plateau's scatter.
OVERSHOOT, OVERSHOOT_SIGMAS = 0.03, 3.0
# If both flanks support different responses with more than this value (odds of e^2 to one), another cause is present.
CONTRADICTING = 4.0
# Smallest number of bins from which the scatter of a plateau is computed.
FEWEST_FOR_SCATTER = 4
# Level (share of full scale) above which a profile is regarded as clipped; clipping makes an edge asymmetric.
CUT_OFF_SHARE = 0.995


@dataclass(frozen=True, slots=True)
class ResponseEvidence:
    """Result of comparing two camera responses by the shape of the edges.

    Parameters
    ----------
    share_other : float
        Probability of the alternative response, 0 to 1; one half if the edges do not decide.
    assumed, other : str
        Names of the assumed and the alternative response; `other` is empty if the response is known.
    shift_px : float
        Excess of the measured gap if the alternative response is the true one.
    flanks : int
        Number of flanks that could be used.
    """

    share_other: float
    assumed: str
    other: str
    shift_px: float
    flanks: int


def response_evidence(
    seen: Sequence[tuple[GreyImage, EdgePoints]], settings: Settings, shift_px: float, *, lossy: bool = False
) -> ResponseEvidence:
    """Compare the assumed camera response with the alternative response.

    Parameters
    ----------
    seen : sequence of (ndarray, EdgePoints)
        Pictures turned so that the tips point up, and the edges fitted in them.
    settings : Settings
        Settings with both responses.
    shift_px : float
        Change of the gap between the two responses.
    lossy : bool
        Whether the pictures were compressed with loss.
    """
    assumed, other = settings.response, settings.other_response
    if other is None:
        return ResponseEvidence(0.0, assumed.name, "", 0.0, 0)
    floor = LOSSY_SHARE if lossy else MODEL_SHARE
    found = [each for side in range(2 if seen else 0) if (each := _odds(seen, side, settings, floor)) is not None]
    odds = float(np.clip(_agreed(found), -LARGEST_ODDS, LARGEST_ODDS))
    return ResponseEvidence(1.0 / (1.0 + float(np.exp(-0.5 * odds))), assumed.name, other.name, shift_px, len(found))


def _agreed(odds: list[float]) -> float:
    """Sum of the log likelihood ratios of the two flanks; 0 if one ratio is missing or the ratios contradict."""
    if len(odds) < 2 or (odds[0] * odds[1] < 0.0 and min(map(abs, odds)) > CONTRADICTING):
        return 0.0
    return sum(odds)


def _odds(seen: Sequence[tuple[GreyImage, EdgePoints]], side: int, settings: Settings, floor: float) -> float | None:
    """Twice the log likelihood ratio for the alternative response from one flank; None if the flank is unsuitable."""
    levels = int(np.iinfo(seen[0][0].dtype).max) + 1
    top = settings.response.top_level or top_level(seen[0][0], settings.bits)
    identity = np.arange(levels, dtype=np.float64)
    stored = flank_profile(seen, side, identity)
    if stored is None or stored.level.max() > CUT_OFF_SHARE * top or stored.level.min() < 0.5:
        return None
    ends = max(2, stored.level.size // 6)
    low, high = sorted((float(np.median(stored.level[:ends])), float(np.median(stored.level[-ends:]))))
    scatter = max(float(np.std(stored.level[:ends])), float(np.std(stored.level[-ends:])))
    over = max(OVERSHOOT * (high - low), OVERSHOOT_SIGMAS * scatter)
    if stored.level.max() > high + over or stored.level.min() < low - over:
        return None
    blur_px = float(np.median([edges.blur_px[side, 0] for _, edges in seen]))
    tip_px = float(np.median([edges.blur_px[side, 1] for _, edges in seen]))
    if blur_px**2 + PIXEL_VARIANCE > (1.0 + WIDER) * (tip_px**2 + PIXEL_VARIANCE):
        return None  # the optics blur flank and tip alike; motion or a side wall widens only the flank
    u_level = np.hypot(np.hypot(stored.u_level, floor * (high - low)), _pattern(stored, ends))
    fits = []
    for response in (settings.response, settings.other_response):
        assert response is not None  # noqa: S101 - the caller has looked
        table = response.table(top, levels)
        profile = flank_profile(seen, side, table)
        assert profile is not None  # noqa: S101 - as `stored`
        gain = np.interp(stored.level, identity, np.gradient(table))
        fits.append(fit_step(replace(profile, u_level=np.maximum(u_level * gain, 1e-6)), blur_px, sloping=True))
    # A misfit of both responses is an error of the model; the residual of the better fit then replaces the stated
    # noise.
    excess = max(min(fit.chi_square for fit in fits) / fits[0].freedom, 1.0)
    return (fits[0].chi_square - fits[1].chi_square) / excess


def _pattern(stored: FlankProfile, ends: int) -> Floats:
    """Scatter in each bin due to a pattern on the finger or on the background."""
    level = stored.level
    inner, outer = float(np.median(level[:ends])), float(np.median(level[-ends:]))
    outside = np.clip((level - inner) / (outer - inner), 0.0, 1.0) if outer != inner else np.zeros_like(level)
    scatter = [_scatter(stored.away_px[part], level[part]) for part in (slice(None, ends), slice(-ends, None))]
    return np.asarray(np.hypot(scatter[0] * (1.0 - outside), scatter[1] * outside))


def _scatter(away: Floats, level: Floats) -> float:
    """Standard deviation about a straight line; zero if there are too few bins."""
    if away.size < FEWEST_FOR_SCATTER:
        return 0.0
    slope, at = np.polyfit(away, level, 1)
    return float(np.sqrt(np.sum((level - at - slope * away) ** 2) / (away.size - 2)))
