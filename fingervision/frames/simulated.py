"""A simulated camera: a rendered gripper that opens and closes endlessly with a known gap."""

from collections.abc import Iterator
from itertools import count
from math import cos, pi
from threading import Event
from time import monotonic

import numpy as np

from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Coding, Frame, Pixels
from fingervision.frames.source import Description, Endable, Received, Wish

NAME = "simulated"
# Scale of the camera, and smallest and largest gap of the gripper (mm), as in the paper (sources in
# docs/explanation/sources.md).
PX_PER_MM = 34.0
CLOSED_MM, OPEN_MM = 1.0, 4.0
# Number of frames of one cycle, which is rendered once and then repeated with the same noise, because rendering takes
# longer than measuring.
CYCLE_FRAMES = 100
USUAL_SIZE_PX, USUAL_RATE_HZ = (640, 480), 25.0
BELOW_TIP_MM = 0.3
SEED = 1


def accepts(name: str) -> bool:
    """Whether a name is the word `simulated`."""
    return name == NAME


def open_frames(name: str, wish: Wish) -> "SimulatedGripper":
    """Start the simulated gripper with the requested size and frame rate.

    Raises
    ------
    UsageError
        If the rate or size is not that of a camera.
    """
    rate_hz = USUAL_RATE_HZ if wish.rate_hz is None else wish.rate_hz
    return SimulatedGripper(wish.size_px or USUAL_SIZE_PX, rate_hz)


def true_gap_mm(index: int) -> float:
    """Gap that is rendered in a frame, before rounding to grey levels (mm)."""
    return CLOSED_MM + (OPEN_MM - CLOSED_MM) * 0.5 * (1.0 - cos(2.0 * pi * (index % CYCLE_FRAMES) / CYCLE_FRAMES))


class SimulatedGripper(Endable):
    """A simulated camera; frames come at its frame rate, with exact times.

    Parameters
    ----------
    size_px : (int, int)
        Width and height.
    rate_hz : float
        Frames per second.
    """

    has_own_clock = True
    px_per_mm = PX_PER_MM

    def __init__(self, size_px: tuple[int, int], rate_hz: float) -> None:
        if not 1.0 <= rate_hz <= 1000.0:
            raise UsageError(f"--rate-hz must be between 1 and 1000, but is {rate_hz:g}.")
        if not (320 <= size_px[0] <= 4096 and 240 <= size_px[1] <= 4096):
            raise UsageError(
                f"--size of the simulated camera must be 320x240 to 4096x4096, but is {size_px[0]}x{size_px[1]}."
            )
        self._size_px, self._rate_hz = size_px, rate_hz
        self._closed = Event()
        self.description = Description(
            name=NAME,
            kind="simulated camera",
            codec="none",
            coding=Coding.LOSSLESS,
            width_px=size_px[0],
            height_px=size_px[1],
            rate_hz=rate_hz,
            has_times=True,
            frame_count=None,
        )

    def received(self) -> Iterator[Received]:
        """Yield the frames in real time, until the camera is closed."""
        rng = np.random.default_rng(SEED)
        drawn: dict[int, Pixels] = {}
        started_s = monotonic()
        for index in count():
            place = index % CYCLE_FRAMES
            if place not in drawn:
                drawn[place] = self._drawn(place, rng)
            time_s = index / self._rate_hz
            # If rendering is too slow, the camera becomes slower; it never delivers frames faster to catch up.
            started_s = max(started_s, monotonic() - time_s - 1.0 / self._rate_hz)
            if self._closed.wait(max(0.0, started_s + time_s - monotonic())):
                return
            yield Received(Frame(drawn[place], index, time_s), monotonic())

    def _drawn(self, place: int, rng: np.random.Generator) -> Pixels:
        # Imported here, because the import takes a third of a second.
        from fingervision.rendering import Camera, render, two_fingers

        # In a picture narrower than 640 px, the gripper opens less.
        share = min(1.0, self._size_px[0] / 640)
        scene = two_fingers(
            gap_px=share * true_gap_mm(place) * PX_PER_MM,
            below_tip_px=BELOW_TIP_MM * PX_PER_MM,
            radius_px=20.0,
            tilt_deg=(1.0, -1.0),
            frame=self._size_px,
        )
        return render(scene, Camera(blur_px=0.9, noise_grey=2.0), rng)
