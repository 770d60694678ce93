"""Two plain bars in an H.264 recording, drawn and coded by the test: nearly every frame has a true gap."""

from pathlib import Path

import av
import numpy as np
from scipy.special import erf

import fingervision as fv

WIDTH, HEIGHT, FRAMES = 480, 160, 41
MOST_REFUSED = 2
"""A frame in twenty: the codec's ringing at a corner may speak against a plain finger. It was one in eight."""
MOST_ERROR_PX = 0.35
"""The largest of 600 errors of such a recording was 0.27 px."""


def edge(at: np.ndarray, place: float) -> np.ndarray:
    return np.asarray(0.5 * (1.0 + erf((at - place) / (1.1 * 2.0**0.5))))


def clip(path: Path, seed: int) -> list[float]:
    """Write the recording, and return the gap (pixels) of every frame."""
    rng = np.random.default_rng(seed)
    x, y = np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5
    gaps = [84.0 - 1.3 * k for k in range(FRAMES)]
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.options = {"crf": "18", "threads": "1"}
        for gap in gaps:
            left, right = 240.0 - gap / 2, 240.0 + gap / 2
            bars = edge(x, left - 70) * (1 - edge(x, left)) + edge(x, right) * (1 - edge(x, right + 70))
            levels = 200.0 - 150.0 * np.outer(1 - edge(y, 110.0), bars) + rng.normal(0.0, 2.0, (HEIGHT, WIDTH))
            picture = av.VideoFrame.from_ndarray(np.clip(levels, 0, 255).astype(np.uint8), format="gray")
            container.mux(stream.encode(picture.reformat(format="yuv420p")))
        container.mux(stream.encode())
    return gaps


def test_plain_bars_are_measured_in_nearly_every_frame(tmp_path: Path) -> None:
    for seed in (3, 22):  # 22 was 0.33 px off, because what the codec leaves looked like a chamfer
        gaps = clip(tmp_path / "plain.mp4", seed)
        found = list(fv.measure(tmp_path / "plain.mp4", px_per_mm=20.0))
        errors = [one.gap_px - gap for one, gap in zip(found, gaps, strict=True) if one.gap_px is not None]
        assert len(errors) >= FRAMES - MOST_REFUSED
        assert np.max(np.abs(errors)) < MOST_ERROR_PX
