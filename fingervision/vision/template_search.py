"""Find a template in a picture by zero-normalised correlation, and check that the match is unique."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

# A second place that is so much like the template, as a share of the best one's correlation, may be the thing too.
ALIKE_SHARE = 0.8
# Fisher's z = artanh(r) of a chance correlation of n independent pixels has the standard deviation 1 / sqrt(n - 3)
# (Fisher, Metron 1, 1921); the largest of a few hundred places stays below 4.5 of these.
CHANCE_SIGMAS, FEWEST_INDEPENDENT = 4.5, 4.0
# How far beyond the search its surroundings are looked at, to see that the best place's lobe ends: wider than the lobe
# of a texture of 4 px.
BEYOND_PX = 5


@dataclass(frozen=True, slots=True)
class Match:
    """The best match of a template.

    Parameters
    ----------
    x_px, y_px : float
        The template's middle, in pixels of the part that was searched, between pixels by a parabola.
    correlation : float
        Zero-normalised.
    is_alone : bool
        Whether no other place is nearly as much like it, and it does not slide to the border of the search.
    """

    x_px: float
    y_px: float
    correlation: float
    is_alone: bool


def best_match(part: Floats, template: Floats, beyond_px: int = BEYOND_PX) -> Match:
    """Find a template in a part of a picture.

    Parameters
    ----------
    part, template : ndarray of float32, shape (height, width)
        Light; the part is larger than the template to every side by how far the thing may be away and `beyond_px`.
    beyond_px : int
        Places so near the border of the search are looked at only to see whether the best one's lobe ends.
    """
    seen = np.asarray(cv2.matchTemplate(part, template, cv2.TM_CCOEFF_NORMED), dtype=np.float32)
    # A part without any contrast has no correlation.
    np.clip(seen, -1.0, 1.0, out=seen)
    inner = seen[beyond_px : seen.shape[0] - beyond_px, beyond_px : seen.shape[1] - beyond_px]
    _, best, _, (column, row) = cv2.minMaxLoc(inner)
    column, row = column + beyond_px, row + beyond_px
    x, y = float(column), float(row)
    if beyond_px:
        x += _vertex(seen[row, column - 1], seen[row, column], seen[row, column + 1])
        y += _vertex(seen[row - 1, column], seen[row, column], seen[row + 1, column])
    return Match(
        x + 0.5 * (template.shape[1] - 1),
        y + 0.5 * (template.shape[0] - 1),
        float(best),
        best > 0.0 and _is_alone(np.asarray(seen, dtype=np.float32), column, row, float(best), beyond_px),
    )


def _is_alone(seen: Floats, column: int, row: int, best: float, beyond_px: int) -> bool:
    alike = (seen >= ALIKE_SHARE * best).astype(np.uint8)
    # The lobe of the best place, as far as it hangs together.
    _, _, _, (left, top, width, height) = cv2.floodFill(alike, None, (column, row), 2)
    slides = left == 0 or top == 0 or left + width == seen.shape[1] or top + height == seen.shape[0]
    inner = alike[beyond_px : seen.shape[0] - beyond_px, beyond_px : seen.shape[1] - beyond_px]
    return not slides and not np.any(inner == 1)


def _vertex(before: float, middle: float, after: float) -> float:
    bend = float(before) - 2.0 * float(middle) + float(after)
    return 0.5 * (float(before) - float(after)) / bend if bend < 0.0 else 0.0


def independent_pixels(template: Floats) -> float:
    """Number of independent pixels in a texture: its pixels divided by the area of its squared autocorrelation."""
    levels = template.astype(np.float64) - template.mean()
    spectrum = np.abs(np.fft.fft2(levels, [2 * size for size in levels.shape])) ** 2
    correlation = np.fft.ifft2(spectrum).real
    if correlation[0, 0] <= 0.0:
        return 0.0
    return float(levels.size / np.sum((correlation / correlation[0, 0]) ** 2))


def chance_correlation(template: Floats) -> float:
    """Correlation that an unrelated texture of the same coarseness may reach by chance somewhere in a search."""
    return float(np.tanh(CHANCE_SIGMAS / np.sqrt(max(independent_pixels(template), FEWEST_INDEPENDENT) - 3.0)))


def high_pass_noise(levels: Floats) -> float:
    """Standard deviation of white noise, from a high-pass filter (a second difference along each axis).

    Immerkaer, Computer Vision and Image Understanding 64(2), 1996, doi:10.1006/cviu.1996.0060.
    """
    inner = levels.astype(np.float64)
    across = inner[:, :-2] - 2.0 * inner[:, 1:-1] + inner[:, 2:]
    both = across[:-2] - 2.0 * across[1:-1] + across[2:]
    return float(np.sqrt(np.mean(both**2)) / 6.0)
