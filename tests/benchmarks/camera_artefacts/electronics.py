"""From light to the stored picture: noise, transfer curve, sharpening, mosaic, zoom, denoising, compression."""

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]


def noisy(light: Floats, sigma: float, rng: np.random.Generator) -> Floats:
    """Read noise of so much of full scale."""
    return light + sigma * rng.standard_normal(light.shape)


def power_law(light: Floats, gamma: float = 2.2) -> Floats:
    """Levels of a camera whose transfer curve is a power of 1 / gamma."""
    return np.asarray(np.clip(light, 0.0, 1.0) ** (1.0 / gamma))


def stored(levels: Floats) -> Picture:
    """Eight bits."""
    return np.clip(np.rint(255.0 * levels), 0, 255).astype(np.uint8)


def sharpened(levels: Floats, amount: float, radius_px: float) -> Floats:
    """Unsharp mask."""
    soft = cv2.GaussianBlur(levels, (0, 0), radius_px)
    return np.asarray(levels + amount * (levels - soft))


def mosaic(light: Floats, sigma: float, rng: np.random.Generator) -> Floats:
    """Grey picture of a colour sensor: one colour a pixel, joined bilinearly, luma of the three."""
    raw = np.clip(np.rint(65535.0 * noisy(light, sigma, rng)), 0, 65535).astype(np.uint16)
    colour = cv2.cvtColor(raw, cv2.COLOR_BayerRG2RGB)
    return np.asarray(colour.astype(np.float64) @ np.array([0.299, 0.587, 0.114]) / 65535.0)


def enlarged(levels: Floats, times: float, size_px: tuple[int, int]) -> Floats:
    """Digital zoom: the part in the middle, interpolated to the picture's size; its centre stays where it is."""
    width, height = size_px
    x = (np.arange(width) - 0.5 * (width - 1)) / times + 0.5 * (levels.shape[1] - 1)
    y = (np.arange(height) - 0.5 * (height - 1)) / times + 0.5 * (levels.shape[0] - 1)
    map_x, map_y = np.meshgrid(x.astype(np.float32), y.astype(np.float32))
    return np.asarray(
        cv2.remap(levels.astype(np.float32), map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    ).astype(np.float64)


def jpeg(picture: Picture, quality: int) -> Picture:
    """Coded and decoded again."""
    _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def denoised(picture: Picture, how: str) -> Picture:
    """In-camera noise reduction."""
    if how == "median":
        return np.asarray(cv2.medianBlur(picture, 3), dtype=np.uint8)
    if how == "bilateral":
        return np.asarray(cv2.bilateralFilter(picture, 5, 12.0, 1.5), dtype=np.uint8)
    return np.asarray(cv2.fastNlMeansDenoising(picture, None, 4.0, 5, 11), dtype=np.uint8)
