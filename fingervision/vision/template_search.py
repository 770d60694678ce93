"""Find a template in a picture by zero-normalised correlation, and check that the match is unique."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop

Floats = NDArray[np.float32]

# Correlation at a second position, relative to the best match, above which the match is not unique.
ALIKE_SHARE = 0.8
# Number of standard deviations of a chance correlation, which the largest of a few hundred positions does not exceed,
# and least number of independent pixels. For n independent pixels, Fisher's z = artanh(r) has the standard deviation 1
# / sqrt(n - 3) (Fisher, Metron 1, 1921).
CHANCE_SIGMAS, FEWEST_INDEPENDENT = 4.5, 4.0
# Width (pixels) of the border around the searched area in which the correlation must decrease from the best match; it
# is wider than the correlation peak of a texture of 4 px.
BEYOND_PX = 5

_best = loop("template_search_best")


@dataclass(frozen=True, slots=True)
class Match:
    """The best match of a template in a picture.

    Parameters
    ----------
    x_px, y_px : float
        Middle of the template, in pixels of the searched part, interpolated between pixels by a parabola.
    correlation : float
        Zero-normalised correlation at the best match.
    is_alone : bool
        Whether the match is unique: no other position has a similar correlation, and the maximum is not at the border
        of the searched area.
    """

    x_px: float
    y_px: float
    correlation: float
    is_alone: bool


class Template:
    """A picture of an object, prepared for repeated searches.

    Parameters
    ----------
    levels : ndarray of float32, shape (height, width)
        Light of the template.
    """

    def __init__(self, levels: Floats) -> None:
        self.levels = levels
        self._centred = np.asarray(levels - levels.mean(dtype=np.float64), dtype=np.float32)
        self._norm = float(np.linalg.norm(self._centred.astype(np.float64)))
        self._spectra: dict[tuple[int, ...], Floats] = {}

    def best_match(self, part: Floats, beyond_px: int = BEYOND_PX) -> Match:
        """Find the template in a part of a picture.

        Parameters
        ----------
        part : ndarray of float32, shape (height, width)
            Light of the searched part; on every side it is larger than the template by the largest displacement and
            `beyond_px`.
        beyond_px : int
            Width of the border of the searched area that only serves to check whether the correlation falls off around
            the best match.
        """
        height, width = part.shape
        rows, columns = self.levels.shape
        centred = part - part.mean()
        size = (cv2.getOptimalDFTSize(height), cv2.getOptimalDFTSize(width))
        padded = cv2.copyMakeBorder(centred, 0, size[0] - height, 0, size[1] - width, cv2.BORDER_CONSTANT)
        seen = cv2.mulSpectrums(cv2.dft(padded), self._spectrum(size), 0, conjB=True)
        product = cv2.dft(seen, flags=cv2.DFT_INVERSE | cv2.DFT_SCALE | cv2.DFT_REAL_OUTPUT)
        x, y, correlation, is_alone = _best(centred, product, columns, rows, self._norm, beyond_px)
        return Match(x + 0.5 * (columns - 1), y + 0.5 * (rows - 1), correlation, is_alone)

    def _spectrum(self, size: tuple[int, int]) -> Floats:
        if size not in self._spectra:
            padded = np.zeros(size, dtype=np.float32)
            padded[: self.levels.shape[0], : self.levels.shape[1]] = self._centred
            self._spectra[size] = np.asarray(cv2.dft(padded), dtype=np.float32)
        return self._spectra[size]


def independent_pixels(template: Floats) -> float:
    """Number of independent pixels of a texture: its pixels divided by the area under its squared autocorrelation."""
    levels = template.astype(np.float64) - template.mean()
    spectrum = np.abs(np.fft.fft2(levels, [2 * size for size in levels.shape])) ** 2
    correlation = np.fft.ifft2(spectrum).real
    if correlation[0, 0] <= 0.0:
        return 0.0
    return float(levels.size / np.sum((correlation / correlation[0, 0]) ** 2))


def chance_correlation(template: Floats) -> float:
    """Largest correlation that an unrelated texture of the same coarseness is likely to reach somewhere by chance."""
    return float(np.tanh(CHANCE_SIGMAS / np.sqrt(max(independent_pixels(template), FEWEST_INDEPENDENT) - 3.0)))


def high_pass_noise(levels: Floats) -> float:
    """Standard deviation of white noise, from a high-pass filter (a second difference along each axis).

    Source: Immerkaer, Computer Vision and Image Understanding 64(2), 1996, doi:10.1006/cviu.1996.0060.
    """
    inner = levels.astype(np.float64)
    across = inner[:, :-2] - 2.0 * inner[:, 1:-1] + inner[:, 2:]
    both = across[:-2] - 2.0 * across[1:-1] + across[2:]
    return float(np.sqrt(np.mean(both**2)) / 6.0)
