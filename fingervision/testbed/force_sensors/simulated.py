"""A simulated force sensor: the force of the simulated gripper, with the converter's quantisation and noise."""

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.storage.toml_section import Section
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.simulation.drifting_clock import OwnClock
from fingervision.testbed.simulation.gripper import SimulatedGripper

KEYS = ("full_scale_n", "noise_n", "rate_hz", "bits")
SIMULATED = True
# A load cell for the published 5.5 N in either direction, read by the 10-bit converter of an ATmega328P.
FULL_SCALE_N, NOISE_N, RATE_HZ, BITS = 10.0, 0.01, 200.0, 10
ANSWER_S = 0.001


class SimulatedForceSensor:
    """Force at the drive, sampled by a board with its own clock.

    Parameters
    ----------
    clock : Clock
        Clock of the test bed.
    gripper : SimulatedGripper
        The gripper whose drive force is measured.
    full_scale_n : float
        Largest measurable force, in either direction.
    noise_n : float
        Standard deviation of one sample.
    rate_hz : float
        Samples per second.
    step_n : float
        Quantisation step of the converter.
    rng : numpy.random.Generator
        Generator for clock and noise.
    """

    name = "simulated force sensor"

    def __init__(
        self,
        clock: Clock,
        gripper: SimulatedGripper,
        full_scale_n: float,
        noise_n: float,
        rate_hz: float,
        step_n: float,
        rng: np.random.Generator,
    ) -> None:
        self.full_scale_n = full_scale_n
        self._clock, self._gripper, self._noise_n, self._rate_hz, self._step_n = (
            clock, gripper, noise_n, rate_hz, step_n,
        )  # fmt: skip
        self._rng, self._board = rng, OwnClock.drawn(rng)
        self._next = int(np.ceil(self._board.shows_s(clock.now_s()) * rate_hz))
        self._answered_s = clock.now_s()

    def readings(self) -> tuple[Reading, ...]:
        """Samples since the last call, and one taken now."""
        asked_s = self._clock.now_s()
        self._clock.wait_until(asked_s + ANSWER_S)
        got_s = self._clock.now_s()
        now_s = self._board.shows_s(asked_s + 0.5 * ANSWER_S)
        last = int(np.floor(now_s * self._rate_hz))
        streamed = [Reading(k / self._rate_hz, self._answered_s, got_s, self._force_n(k / self._rate_hz))
                    for k in range(self._next, last + 1)]  # fmt: skip
        self._next, self._answered_s = last + 1, got_s
        return (*streamed, Reading(now_s, asked_s, got_s, self._force_n(now_s)))

    def close(self) -> None:
        """Do nothing: there is no hardware to release."""

    def _force_n(self, device_s: float) -> float:
        true = self._gripper.at(self._board.bed_s(device_s)).force_n
        force_n = (0.0 if true is None else float(true[0])) + self._noise_n * float(self._rng.standard_normal())
        return float(np.clip(np.rint(force_n / self._step_n) * self._step_n, -self.full_scale_n, self.full_scale_n))


def build(section: Section, context: BuildContext) -> SimulatedForceSensor:
    """Build the sensor from its section of the configuration."""
    if context.gripper is None:
        raise DataError(
            f"A simulated force sensor ({section.at('kind')}) must have a simulated gripper, but the test bed "
            "has none: "
            "add a [gripper]."
        )
    full_scale_n = section.number("full_scale_n", FULL_SCALE_N, above=0.0)
    bits = section.whole("bits", BITS, low=6, high=24)
    return SimulatedForceSensor(
        context.clock,
        context.gripper,
        full_scale_n,
        section.number("noise_n", NOISE_N, low=0.0),
        section.number("rate_hz", RATE_HZ, low=1.0, high=10000.0),
        2.0 * full_scale_n / 2**bits,
        np.random.default_rng([context.seed, 2]),
    )
