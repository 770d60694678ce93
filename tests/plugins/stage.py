"""A stage as a plug-in of its maker: it moves at the requested speed, on the test bed's clock."""

from fingervision.domain.errors import FingervisionError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, StageLimits
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.motion.move_limits import check_move, check_speed

KEYS = ("upper_mm",)
SIMULATED = True


class Stage:
    name = "stage of a plug-in"
    has_steps = False
    alarm: Alarm | None = None

    def __init__(self, clock: Clock, upper_mm: float) -> None:
        self.limits = StageLimits(-1.0, upper_mm, 20.0, 5.0)
        self._clock = clock
        self._from_mm, self._to_mm, self._speed_mm_s, self._began_s = 0.0, 0.0, 1.0, clock.now_s()

    def _end_s(self) -> float:
        return self._began_s + abs(self._to_mm - self._from_mm) / self._speed_mm_s

    def _at_mm(self, time_s: float) -> float:
        if time_s >= self._end_s():
            return self._to_mm
        way_mm = self._speed_mm_s * max(0.0, time_s - self._began_s)
        return self._from_mm + (way_mm if self._to_mm > self._from_mm else -way_mm)

    @property
    def busy(self) -> bool:
        return self._clock.now_s() < self._end_s()

    def home(self) -> None:
        self.move(0.0, 1.0)

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        check_move(self.limits, to_mm, speed_mm_s)

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        check_move(self.limits, to_mm, speed_mm_s)
        if self.busy:
            raise FingervisionError(
                "The stage must be at rest before a new motion, but is still moving: stop it first."
            )
        now_s = self._clock.now_s()
        self._from_mm, self._to_mm, self._speed_mm_s, self._began_s = self._at_mm(now_s), to_mm, speed_mm_s, now_s

    def jog(self, speed_mm_s: float) -> None:
        check_speed(self.limits, abs(speed_mm_s))
        if speed_mm_s:
            self.move(self.limits.upper_mm if speed_mm_s > 0 else self.limits.lower_mm, abs(speed_mm_s))

    def run_step(self, number: int) -> None:
        raise FingervisionError(f"Step {number} must be kept by a controller, but this stage has none: use move.")

    def stop(self) -> None:
        now_s = self._clock.now_s()
        self._from_mm = self._to_mm = self._at_mm(now_s)

    def readings(self) -> tuple[Reading, ...]:
        asked_s = self._clock.now_s()
        self._clock.wait_until(asked_s + 0.0005)
        got_s = self._clock.now_s()
        at_s = 0.5 * (asked_s + got_s)
        return (Reading(at_s, asked_s, got_s, self._at_mm(at_s), at_s < self._end_s()),)

    def close(self) -> None:
        self.stop()


def build(section: Section, context: BuildContext) -> Stage:
    return Stage(context.clock, section.number("upper_mm", 4.0, above=0.0))
