"""The inspected sample: some frames of a recording, with their measurements and intermediate results."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.short_repr import ShortRepr
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.frames.source import Description
from fingervision.inspection.blocks import blockiness
from fingervision.inspection.finding import GOOD_PX, MOSTLY_REFUSED, POOR_TIMES
from fingervision.inspection.ground_shift import GroundShift, GroundTracker
from fingervision.inspection.look import Look
from fingervision.inspection.noise_bound import GOOD_BLUR_PX, GOOD_NOISE
from fingervision.measuring.camera_learning import learnt_first
from fingervision.measuring.scale import Scale
from fingervision.vision.binarise import binarise
from fingervision.vision.fingers import CoarseFingers
from fingervision.vision.gap import SMEARED
from fingervision.vision.grey import denoise, to_grey, top_level
from fingervision.vision.pipeline import Settings, look_closely, measure_frame

Floats = NDArray[np.float64]

# Number of frames inspected in detail, evenly distributed over all frames read: enough to average noise, and few enough
# for 4K frames.
CLOSELY = 16
# Rims and side walls of a tenth of the contrast can be detected below this ratio of noise to contrast.
SEEING_NOISE = 2.0 * GOOD_NOISE
# Ratio of the median difference between neighbouring pixels to the noise (0.6745 sqrt(2) for normal noise), and ratio
# of noise to contrast (five times that of a good set-up) above which outlines are lost.
STEP_OF_NOISE, LOST_NOISE = 0.954, 5.0 * GOOD_NOISE
# Quantile of the slopes that represents the edges, and blur (twice that of a good set-up) above which outlines are
# lost.
STEEPEST, LOST_BLUR_PX = 0.995, 2.0 * GOOD_BLUR_PX
# Fingers and gap fill the picture if they occupy this share of it, because the fingers need the rest to move.
FILLED = 0.6


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sample(ShortRepr):
    """Frames of a recording and their measurements, from which all findings are computed.

    Parameters
    ----------
    description : Description
        The recording.
    settings : Settings
        Settings of the measurement, with the camera as learnt from the first frames.
    scale : Scale or None
        Conversion from pixels to millimetres; None if not stated.
    looks : tuple of Look
        Frames with a measured gap, inspected in detail.
    refused : dict of Status to NoGap
        First refusal of each kind.
    refused_frame : Frame or None
        First picture without a measured gap.
    refused_fingers : CoarseFingers or None
        The fingers in this picture to the nearest pixel; None if none were found.
    counts : Counter of Status
        Number of frames with each status.
    track : ndarray, shape (n, 7)
        For every frame with a measured gap: its number, position of the left and right measuring point across the
        fingers, positions of both tips along the fingers, standard uncertainties across and of the tips (pixels).
    ground : GroundShift
        Motion of the background relative to the first frame.
    last_frame : Frame or None
        Frame to be shown in the picture of the inspection.
    """

    description: Description
    settings: Settings
    scale: Scale | None
    looks: tuple[Look, ...]
    refused: dict[Status, NoGap]
    refused_frame: Frame | None
    refused_fingers: CoarseFingers | None
    counts: Counter[Status]
    track: Floats
    ground: GroundShift

    @property
    def frames(self) -> int:
        """Number of frames that were read."""
        return sum(self.counts.values())

    @property
    def top_level(self) -> int:
        """Full scale of the pictures (grey levels)."""
        if self.settings.response.top_level is not None:
            return self.settings.response.top_level
        frame = self.looks[0].frame if self.looks else self.refused_frame
        return 255 if frame is None else top_level(to_grey(frame.pixels), self.settings.bits)

    @property
    def fill(self) -> float:
        """Share of the picture's extent across the fingers that fingers and gap together occupy.

        The share is 1 if fingers and gap extend beyond the picture. If no frame was measured, the share is that of the
        fingers found in the first unmeasured picture; it is 0 if none were found.
        """
        seen = [look.fingers for look in self.looks]
        if not seen and self.refused_fingers is not None:
            seen = [self.refused_fingers]
        shares = [0.0]
        for fingers in seen:
            found = [finger.outline[:, 0] for finger in (fingers.left, fingers.right)]
            extent = max(float(x.max()) for x in found) - min(float(x.min()) for x in found)
            shares.append(extent / fingers.orientation.across_size)
        return max(shares)

    @property
    def is_lost_in_smallness(self) -> bool:
        """Whether most pictures are unmeasured, and the fingers in them so small that this alone is a poor set-up."""
        is_small = 0.0 < self.fill < FILLED / POOR_TIMES ** (2.0 / 3.0)
        return is_small and self.counts[Status.NO_FINGERS] > MOSTLY_REFUSED * self.frames

    @property
    def good_px(self) -> float:
        """Cost (in pixels of this picture) below which a correction is not worth while.

        If the fingers do not fill the picture, a pixel covers more of the object than necessary, and the limit of the
        cost is proportionally lower.
        """
        return GOOD_PX * min(1.0, self.fill / FILLED) if self.looks else GOOD_PX

    @property
    def moves(self) -> bool:
        """Whether motion blurs the flanks in most frames; the other causes of blur then cannot be determined."""
        return self.median(float(look.widened_px2.any()) for look in self.looks) > 0.5

    @property
    def is_lost_in_noise(self) -> bool:
        """Whether fingers or background in the first unmeasured picture hardly exceed its noise."""
        if self.refused_frame is None:
            return False
        grey = to_grey(self.refused_frame.pixels)
        contrast = binarise(denoise(grey), self.top_level).contrast
        steps = np.abs(np.diff(grey.astype(np.float64), axis=1))
        return float(np.median(steps)) / STEP_OF_NOISE > LOST_NOISE * contrast

    @property
    def refused_blur_px(self) -> float:
        """Approximate blur of the steepest edges in the first unmeasured picture (pixels).

        The blur is the contrast divided by the steepest slope and by sqrt(2 pi), minus the blur of the smoothing.
        """
        if self.refused_frame is None:
            return 0.0
        grey = to_grey(self.refused_frame.pixels)
        contrast = binarise(denoise(grey), self.top_level).contrast
        soft = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), 1.0)
        slope = np.hypot(cv2.Sobel(soft, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(soft, cv2.CV_32F, 0, 1, scale=0.125))
        steepest = float(np.quantile(slope, STEEPEST))
        spread = contrast / max(steepest, 1e-6) / float(np.sqrt(2.0 * np.pi))
        return float(np.sqrt(max(spread**2 - 1.0, 0.0)))

    @property
    def is_smeared(self) -> bool:
        """Whether frames are unmeasured because the fingers moved too far during the exposure."""
        return Status.BLURRED in self.refused and self.refused[Status.BLURRED].words.startswith(SMEARED)

    @property
    def is_lost_in_blur(self) -> bool:
        """Whether unmeasured pictures are out of focus: strong blur rounds a tip until it cannot be found."""
        return not self.is_lost_in_noise and self.refused_blur_px > LOST_BLUR_PX

    @property
    def blockiness(self) -> float:
        """Strength of a codec's block artefacts."""
        return self.median(blockiness(look.frame.pixels) for look in self.looks)

    @property
    def u_shift_px(self) -> float:
        """Standard uncertainty of the gap (px) stated by `measure` for disturbances beside the edges and clipping."""
        return self.median(look.outcome.u_shift_px for look in self.looks)

    @property
    def shows_surroundings(self) -> bool:
        """Whether the noise is low enough to detect disturbances beside an edge."""
        return self.median(look.noise for look in self.looks) <= SEEING_NOISE

    def median(self, values: Iterable[float]) -> float:
        """Median of one value per frame inspected in detail; 0 without values."""
        each = list(values)
        return float(np.median(each)) if each else 0.0


def take_sample(
    frames: Iterable[Frame | LostFrame], description: Description, settings: Settings, scale: Scale | None
) -> Sample:
    """Measure frames and keep the data from which findings are computed.

    Parameters
    ----------
    frames : iterable of Frame or LostFrame
        Frames to be inspected, already limited in number.
    description : Description
        The recording.
    settings : Settings
        Settings of the measurement.
    scale : Scale or None
        Conversion from pixels to millimetres.
    """
    frames, camera = learnt_first(frames, settings, scale)
    settings = replace(settings, camera=camera)
    kept: list[Frame] = []
    every, read = 1, 0
    counts: Counter[Status] = Counter()
    refused: dict[Status, NoGap] = {}
    refused_frame: Frame | None = None
    track: list[tuple[float, ...]] = []
    tracker = GroundTracker()
    for item in frames:
        if isinstance(item, LostFrame):
            counts[item.status] += 1
            refused.setdefault(item.status, NoGap(item.status, item.words))
            continue
        outcome = measure_frame(item, settings)
        counts[outcome.status] += 1
        if isinstance(outcome, NoGap):
            refused.setdefault(outcome.status, outcome)
            refused_frame = refused_frame or item
            continue
        track.append(_place(item.index, outcome))
        tracker.add(item, outcome)
        if read % every == 0:
            kept.append(item)
            if len(kept) > 2 * CLOSELY:
                kept, every = kept[::2], 2 * every
        read += 1
    kept = kept[:: max(1, -(-len(kept) // CLOSELY))]
    looks = _looks(kept, settings)
    found = np.array(track, dtype=np.float64).reshape(-1, 7)
    fingers = None if refused_frame is None else look_closely(refused_frame, settings)[1]
    return Sample(
        description,
        settings,
        scale,
        looks,
        refused,
        refused_frame,
        fingers,
        counts,
        found,
        tracker.shift(),
    )


def _looks(frames: Iterable[Frame], settings: Settings) -> tuple[Look, ...]:
    looks = []
    for frame in frames:
        outcome, fingers, edges = look_closely(frame, settings)
        if isinstance(outcome, GapMeasurement) and fingers is not None and edges is not None:
            grey = to_grey(frame.pixels)
            if settings.region is not None:
                r = settings.region
                grey = grey[r.y_px : r.y_px + r.height_px, r.x_px : r.x_px + r.width_px]
            top = settings.response.top_level or top_level(grey, settings.bits)
            looks.append(Look(frame, fingers.orientation.view(grey), outcome, fingers, edges, top))
    return tuple(looks)


def _place(index: int, m: GapMeasurement) -> tuple[float, ...]:
    across = (m.left.x_px, m.right.x_px) if m.direction.is_vertical else (m.left.y_px, m.right.y_px)
    u_across, u_tip = (
        float(np.hypot(a, b)) / 2.0
        for a, b in ((m.left.u_across_px, m.right.u_across_px), (m.left.u_tip_px, m.right.u_tip_px))
    )
    return (float(index), *across, m.left.tip_px, m.right.tip_px, u_across, u_tip)
