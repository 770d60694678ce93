"""Random uncertainty of an edge as a function of noise, blur and number of rows: the Cramer-Rao bound.

The package `inspection` only uses ratios of such uncertainties.
"""

from math import pi, sqrt

# A good set-up: ratio of noise to contrast (2 of 100 levels), and blur of an edge (sigma_e, pixels) that is neither
# soft nor undersampled, as a blur below 0.5 px would be.
GOOD_NOISE, GOOD_BLUR_PX = 0.02, 1.3
# Extent of a fit's window to either side: this multiple of the blur, plus these pixels.
REACH_BLURS, REACH_EXTRA_PX = 4.0, 4.0


def edge_noise_px(noise: float, blur_px: float, rows: int = 1) -> float:
    """Standard uncertainty of the position of one edge with unknown levels and blur (pixels).

    The formula is sigma_x^2 = r^2 / (N (1 / (2 sqrt(pi) sigma_e) - 1 / W)), with W the length of the window; Gatherer,
    Stanford CSL-TR-93-560; Kakarala & Hero, IEEE PAMI 14(7), 777-781, 1992.

    Parameters
    ----------
    noise : float
        Ratio r of the noise's standard deviation to the contrast of the edge.
    blur_px : float
        Standard deviation sigma_e of the blur, the pixel's width included.
    rows : int
        Number N of independent rows.
    """
    window_px = 2.0 * (REACH_BLURS * blur_px + REACH_EXTRA_PX)
    return noise / sqrt(rows * (1.0 / (2.0 * sqrt(pi) * blur_px) - 1.0 / window_px))
