"""Rendered scenes as a recording: frames whose true gap is known."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.frames.source import Description

if TYPE_CHECKING:
    from fingervision.rendering import Camera, Scene


@dataclass(frozen=True, slots=True)
class RenderedFrames:
    """A sequence of scenes seen through a rendered camera.

    Parameters
    ----------
    scenes : sequence of Scene
        One scene per frame, all of one size.
    camera : Camera
        Camera through which the scenes are rendered.
    rng : numpy.random.Generator
        Generator of the noise; a second pass over the frames has different noise.
    rate_hz : float or None
        Frames per second; None gives frames without times.

    Raises
    ------
    FingervisionError
        No scene is given, or the scenes differ in frame size.
    """

    scenes: "Sequence[Scene]"
    camera: "Camera"
    rng: np.random.Generator
    rate_hz: float | None = 25.0

    def __post_init__(self) -> None:
        if not self.scenes:
            raise DataError("A rendered recording must have at least one scene, but has none.")
        sizes = {(scene.width_px, scene.height_px) for scene in self.scenes}
        if len(sizes) > 1:
            raise DataError(f"Scenes of a recording must be of one size, but are of {sorted(sizes)}.")

    @property
    def description(self) -> Description:
        """Description of the recording before its frames are rendered."""
        first = self.scenes[0]
        return Description(
            name="rendered",
            kind="rendered scenes",
            codec="none",
            coding=Coding.LOSSLESS,
            width_px=first.width_px,
            height_px=first.height_px,
            rate_hz=self.rate_hz,
            has_times=self.rate_hz is not None,
            frame_count=len(self.scenes),
        )

    def __iter__(self) -> Iterator[Frame | LostFrame]:
        """Render the frames one by one."""
        # Imported here, because the import takes a third of a second, and recordings of cameras do not need it.
        from fingervision.rendering import render

        for index, scene in enumerate(self.scenes):
            time_s = None if self.rate_hz is None else index / self.rate_hz
            yield Frame(render(scene, self.camera, self.rng), index, time_s)
