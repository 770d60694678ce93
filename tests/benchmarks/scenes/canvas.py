"""Painting polygons and lines on a picture of light: area coverage by Agg, then blur, noise and eight bits."""

import cv2
import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.path import Path
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
Points = NDArray[np.float64]
Rng = np.random.Generator


class Canvas:
    """A picture of mean light, in grey levels; the centre of the first pixel is (0, 0), y grows downwards.

    Parameters
    ----------
    width, height : int
        Size in pixels.
    ground : float or ndarray, shape (height, width)
        Light of the empty picture.
    """

    def __init__(self, width: int, height: int, ground: float | Floats) -> None:
        self.width, self.height = width, height
        self.light = np.full((height, width), ground, dtype=np.float64) if np.isscalar(ground) else np.array(ground)

    def coverage(self, points: Points, line_px: float | None = None) -> Floats:
        """Share of every pixel that a closed polygon, or a line of this breadth, covers."""
        renderer = RendererAgg(self.width, self.height, 72)
        context = renderer.new_gc()
        context.set_antialiased(True)
        context.set_snap(False)
        context.set_foreground((0.0, 0.0, 0.0, 1.0))
        context.set_linewidth(0.0 if line_px is None else line_px)
        context.set_capstyle("butt")
        context.set_joinstyle("round")
        flipped = np.column_stack((points[:, 0] + 0.5, self.height - 0.5 - points[:, 1]))
        path = Path(flipped, closed=False)
        path.should_simplify = False
        renderer.draw_path(context, path, IdentityTransform(), (0.0, 0.0, 0.0) if line_px is None else None)
        context.restore()
        return np.asarray(np.asarray(renderer.buffer_rgba())[:, :, 3], dtype=np.float64) / 255.0

    def fill(self, points: Points, tone: float | Floats, opacity: float = 1.0, soft_px: float = 0.0) -> Floats:
        """Paint a polygon and return what it covers."""
        return self._paint(self.coverage(points), tone, opacity, soft_px)

    def stroke(self, points: Points, line_px: float, tone: float | Floats, opacity: float = 1.0) -> Floats:
        """Paint a line."""
        return self._paint(self.coverage(points, line_px), tone, opacity, 0.0)

    def _paint(self, covered: Floats, tone: float | Floats, opacity: float, soft_px: float) -> Floats:
        if soft_px > 0.0:
            covered = np.asarray(cv2.GaussianBlur(covered, (0, 0), soft_px), dtype=np.float64)
        self.light += opacity * covered * (tone - self.light)
        return covered

    def text(self, words: str, x: float, y: float, size: float, tone: float) -> None:
        """Write a line of text."""
        mask = np.zeros((self.height, self.width), dtype=np.uint8)
        thick = max(round(2.0 * size), 1)
        cv2.putText(mask, words, (round(x), round(y)), cv2.FONT_HERSHEY_SIMPLEX, size, 255, thick, cv2.LINE_AA)
        self.light += mask / 255.0 * (tone - self.light)

    def shot(self, blur_px: float, noise: float, rng: Rng, exposure: float = 1.0) -> Picture:
        """The picture as a camera stores it."""
        spread = cv2.GaussianBlur(exposure * self.light, (0, 0), blur_px, borderType=cv2.BORDER_REPLICATE)
        return np.clip(np.rint(spread + noise * rng.standard_normal(spread.shape)), 0, 255).astype(np.uint8)
