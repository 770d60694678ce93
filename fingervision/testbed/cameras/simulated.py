"""A simulated camera, which renders the fingers at their true positions at the time of exposure."""

from dataclasses import dataclass
from math import hypot

import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.errors import DataError
from fingervision.domain.frame import Coding, Frame
from fingervision.domain.response import Response
from fingervision.frames.source import Description
from fingervision.rendering import EVEN_LIGHT, Camera, Patch, Scene, render, two_fingers
from fingervision.rendering.targets import slot
from fingervision.storage.toml_section import Section
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.camera import Latency, Taken
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.simulation.drifting_clock import OwnClock
from fingervision.testbed.simulation.gripper import SimulatedGripper
from fingervision.testbed.simulation.injected_effects import Optics, hidden_in

KEYS = ("width_px", "height_px", "rate_hz", "px_per_mm", "blur_px", "noise_grey", "latency_s", "jitter_s", "fingers_mm",
        "tip_radius_mm", "off_centre_mm")  # fmt: skip
SIMULATED = True
# Hricko & Havlik (2015), section 3: 640 columns, 34 px/mm, 25 frames per second. Only the rows around the tips are read
# out.
WIDTH_PX, HEIGHT_PX, RATE_HZ, PX_PER_MM = 640, 160, 25.0, 34.0
BLUR_PX, NOISE_GREY = 0.9, 2.0
# Smallest latency from exposure to arrival (read-out and transfer), mean of the additional latency, and uncertainty.
LATENCY_S, JITTER_S, U_LATENCY_S = 0.008, 0.0003, 0.0005
# Hricko & Havlik (2015) measure 0.3 mm below the tips, "with minimized error caused by roundedness of fingers": the
# edges are straight there. With round edges, lens distortion would also change the gap through the height of the tips.
# It would be estimated 10 % too large (computed for a radius of 0.9 mm), because the effect in the catalogue does not
# depend on height.
FINGERS_MM, TIP_RADIUS_MM = 1.6, 0.2
# Distance by which the operator shifts the picture.
SHIFT_MM = 0.5


@dataclass(frozen=True, slots=True)
class Placed:
    """Placement of the part in front of the camera: rotated, shifted, or replaced by a slot."""

    turned: bool = False
    shift_mm: float = 0.0
    slot_mm: float | None = None


class SimulatedCamera:
    """A camera in front of the simulated gripper, with its own clock.

    Parameters
    ----------
    clock : Clock
        Clock of the test bed.
    gripper : SimulatedGripper
        The gripper in view.
    optics : Optics
        Scale, lens, blur, noise and injected optical effects.
    size_px : (int, int)
        Width and height.
    rate_hz : float
        Frames per second.
    arrival_s : (float, float)
        Smallest latency from exposure to arrival, and mean of the additional latency.
    fingers_mm : (float, float, float, float)
        Width of the fingers, radius of their tips, their offset from the picture's centre, and distance of the
        measuring point below the tips.
    seed : int
        Seed of clock, latencies and noise.
    """

    def __init__(
        self,
        clock: Clock,
        gripper: SimulatedGripper,
        optics: Optics,
        size_px: tuple[int, int],
        rate_hz: float,
        arrival_s: tuple[float, float],
        fingers_mm: tuple[float, float, float, float],
        seed: int,
    ) -> None:
        self.placed = Placed()
        self.latency = Latency(arrival_s[0], U_LATENCY_S)
        self.description = Description(
            name="simulated", kind="simulated camera", codec="none", coding=Coding.LOSSLESS, width_px=size_px[0],
            height_px=size_px[1], rate_hz=rate_hz, has_times=True, frame_count=None,
        )  # fmt: skip
        self._clock, self._gripper, self._optics, self._rate_hz = clock, gripper, optics, rate_hz
        self._jitter_s, self._fingers_mm, self._seed = arrival_s[1], fingers_mm, seed
        self._own = OwnClock.drawn(np.random.default_rng([seed, 3]))
        self._exposure, self._index = int(np.ceil(self._own.shows_s(clock.now_s()) * rate_hz)), 0
        self._announced: int | None = None
        gripper.looked_at(self._own.bed_s(self._exposure / rate_hz), 1.0 / (rate_hz * self._own.rate))

    def next(self) -> Taken:
        """Wait for the next frame and return it; earlier frames that were not requested are lost."""
        while True:
            device_s, exposed_s, arrived_s = self._times_s()
            is_announced, self._exposure = self._exposure == self._announced, self._exposure + 1
            if is_announced or arrived_s >= self._clock.now_s():
                break
        self._clock.wait_until(arrived_s)
        index, exposure, placed = self._index, self._exposure - 1, self.placed
        self._index += 1
        return Taken(index, device_s, arrived_s, lambda: Frame(self.draw(exposure, exposed_s, placed), index, device_s))

    def ready(self, within_s: float) -> bool:
        """Wait for the next frame, but no longer than a time; return whether it is there."""
        # A camera keeps the newest frame alone.
        while self._times_s(later=1)[2] <= self._clock.now_s():
            self._exposure += 1
        arrived_s, until_s = self._times_s()[2], self._clock.now_s() + within_s
        self._clock.wait_until(min(arrived_s, until_s))
        if arrived_s > until_s:
            return False
        # What it announces is there when it is fetched.
        self._announced = self._exposure
        return True

    def _times_s(self, later: int = 0) -> tuple[float, float, float]:
        """Time stamp, exposure and arrival of the next frame, or of one that many frames later."""
        exposure = self._exposure + later
        device_s = exposure / self._rate_hz
        exposed_s = self._own.bed_s(device_s)
        rng = np.random.default_rng([self._seed, 4, abs(exposure)])
        late_s = self.latency.least_s + self._jitter_s * float(rng.standard_exponential())
        return device_s, exposed_s, exposed_s + late_s

    def place(self, placed: Placed) -> None:
        """Change the placement of the part."""
        self.placed = placed

    def close(self) -> None:
        """Do nothing: there is no hardware to release."""

    def draw(self, exposure: int, exposed_s: float, placed: Placed) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
        """Render the picture of an exposure, by its number, time on the test bed's clock, and placement of the part."""
        optics = self._optics
        if placed.slot_mm is not None:
            scene = self._slot(self._gripper.slot_at(placed.slot_mm, exposed_s - optics.late_s))
        else:
            scene = self._scene(exposed_s - optics.late_s, placed)
        rng = np.random.default_rng([self._seed, 5, abs(exposure)])
        return np.asarray(render(scene, optics.camera, rng), dtype=np.uint8)

    def _slot(self, edges: Response) -> Scene:
        width_px, height_px = self.description.width_px, self.description.height_px
        scale = self._optics.px_per_mm
        hole = slot(
            float(edges.gap_mm[0]) * scale,
            0.7 * height_px,
            x_px=(width_px - 1) / 2 + float(edges.midline_mm[0]) * scale,
            y_px=(height_px - 1) / 2,
            frame=(width_px, height_px),
        )
        return Scene((), width_px, height_px, behind=(Patch(hole, EVEN_LIGHT.fingers),))

    def _scene(self, at_s: float, placed: Placed) -> Scene:
        width_mm, radius_mm, off_mm, below_mm = self._fingers_mm
        scale = self._optics.px_per_mm
        seen = self._gripper.at(at_s)
        middle_mm = float(seen.midline_mm[0]) * (-1.0 if placed.turned else 1.0) + off_mm + placed.shift_mm
        # The measuring height lies in the middle of the picture, where a lens causes no displacement along the fingers.
        below_px, middle_px = below_mm * scale, (self.description.height_px - 1) / 2
        return two_fingers(
            max(float(seen.gap_mm[0]), 0.0) * scale,  # fingers that meet do not pass through each other
            below_tip_px=below_px,
            direction=Direction.DOWN if placed.turned else Direction.UP,
            width_px=width_mm * scale,
            radius_px=radius_mm * scale,
            tip_at_px=middle_px + below_px if placed.turned else middle_px - below_px,
            centre_px=middle_mm * scale,
            frame=(self.description.width_px, self.description.height_px),
        )


def build(section: Section, context: BuildContext) -> SimulatedCamera:
    """Build the camera from its section of the configuration."""
    if context.gripper is None:
        raise DataError(
            f"A simulated camera ({section.at('kind')}) must have a simulated gripper, but the test bed has none: "
            "add a [gripper]."
        )
    width_px = section.whole("width_px", WIDTH_PX, low=160, high=4096)
    height_px = section.whole("height_px", HEIGHT_PX, low=120, high=4096)
    scale = section.number("px_per_mm", PX_PER_MM, above=0.0)
    seen = Camera(
        blur_px=section.number("blur_px", BLUR_PX, low=0.1), noise_grey=section.number("noise_grey", NOISE_GREY, low=0)
    )
    optics = Optics(seen, scale, hypot(width_px, height_px) / 2 / scale)
    return SimulatedCamera(
        context.clock,
        context.gripper,
        hidden_in(optics, context.hidden),
        (width_px, height_px),
        section.number("rate_hz", RATE_HZ, low=1.0, high=1000.0),
        (section.number("latency_s", LATENCY_S, low=0.0), section.number("jitter_s", JITTER_S, low=0.0)),
        (
            section.number("fingers_mm", FINGERS_MM, above=0.0),
            section.number("tip_radius_mm", TIP_RADIUS_MM, low=0.0),
            section.number("off_centre_mm", 0.0),
            context.below_tip_mm,
        ),
        context.seed,
    )
