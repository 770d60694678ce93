"""Stages that do what they are told, whose controllers state their position late: none of them has an alarm."""

import random
import threading

import pytest

from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.actuators._single_axis import AxisSettings, SingleAxis
from fingervision.testbed.clocks.clock import VirtualClock

LIMITS = {"lower_mm": -2.0, "upper_mm": 8.0, "speed_mm_s": 5.0, "force_n": 1e9, "accuracy_mm": 0.002}
LINE_S = 0.003


class RampedStage(SingleAxis):
    """A stage with ramps of `ramp_s` to its speed; its position is refreshed at an interval, and older than that."""

    def __init__(
        self, draw: random.Random, *, ramp_s: float, refreshed_s: float, behind_s: float, reports: bool
    ) -> None:
        self.clock, self.draw = VirtualClock(begin_s=10.0), draw
        limits = StageLimits(**LIMITS, settling_s=0.2 + ramp_s)
        super().__init__("a sound stage", self.clock, AxisSettings(limits))
        self.ramp_s, self.refreshed_s, self.behind_s, self.reports = ramp_s, refreshed_s, behind_s, reports
        # Time, begin, end and speed of each motion.
        self.motions = [(-1e9, 0.0, 0.0, 1.0)]

    def says(self) -> None:
        """Half of a question and its answer."""
        self.clock.wait_until(self.clock.now_s() + self.draw.uniform(0.0, LINE_S))

    def was_at(self, time_s: float) -> tuple[float, bool]:
        began_s, start, end, speed = next(each for each in reversed(self.motions) if each[0] <= time_s)
        way, acceleration, since_s = abs(end - start), speed / self.ramp_s, time_s - began_s
        ramp_s = min(self.ramp_s, (way / acceleration) ** 0.5)
        fastest = max(acceleration * ramp_s, 1e-12)
        lasts_s = ramp_s + way / fastest
        left_s = lasts_s - since_s
        if left_s <= 0.0:
            return end, False
        done = fastest * (since_s - 0.5 * ramp_s)
        if since_s < ramp_s:
            done = 0.5 * acceleration * since_s**2
        elif left_s < ramp_s:
            done = way - 0.5 * acceleration * left_s**2
        return start + (done if end > start else -done), True

    def _position_mm(self) -> float:
        self.says()
        scanned_s = self.clock.now_s() // self.refreshed_s * self.refreshed_s
        at_mm, _ = self.was_at(scanned_s - self.behind_s)
        self.says()
        return at_mm

    def _moving(self) -> bool:
        return self.reports and self.was_at(self.clock.now_s())[1]

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        self.says()
        now_s = self.clock.now_s()
        self.motions.append((now_s, self.was_at(now_s)[0], to_mm, speed_mm_s))
        self.says()

    def _go_home(self) -> None: ...
    def _halt(self) -> None: ...
    def _release(self) -> None: ...


@pytest.mark.parametrize("reports", [True, False])
@pytest.mark.parametrize("ramp_s", [0.001, 0.2, 1.0])
@pytest.mark.parametrize(
    ("refreshed_s", "behind_s"), [(0.001, 0.0), (0.1, 0.0), (0.13, 0.06), (0.19, 0.0), (0.2, -0.2)]
)
def test_no_sound_stage_has_an_alarm(ramp_s: float, refreshed_s: float, behind_s: float, reports: bool) -> None:
    draw = random.Random(36)
    stage = RampedStage(draw, ramp_s=ramp_s, refreshed_s=refreshed_s, behind_s=behind_s, reports=reports)
    at_mm = 0.0
    for _ in range(40):
        speed_mm_s, way_mm = 10.0 ** draw.uniform(-1.3, 0.69), draw.choice((-1, 1)) * 10.0 ** draw.uniform(-2.0, 0.4)
        at_mm = min(max(at_mm + way_mm, -1.9), 7.9)
        stage.move(at_mm, speed_mm_s)
        while stage.busy:
            stage.clock.wait_until(stage.clock.now_s() + 0.01)
            if draw.random() < 0.7:
                stage.readings()
        assert stage.alarm is None
        # The next motion begins at any phase of the interval, often at once.
        stage.clock.wait_until(stage.clock.now_s() + draw.choice((0.0, draw.uniform(0.0, 0.4))))


def test_a_thread_that_reads_while_a_motion_is_begun_sees_it_whole() -> None:
    """A first step that another thread has read belongs to the motion, whose speed is judged by it."""
    stage = RampedStage(random.Random(0), ramp_s=0.001, refreshed_s=0.1, behind_s=-0.2, reports=True)
    reading = threading.Thread(target=stage.readings)
    begin, now_s = stage._begin, stage.clock.now_s

    def begins(to_mm: float, speed_mm_s: float) -> None:
        begin(to_mm, speed_mm_s)
        stage.clock.now_s = looks_late  # type: ignore[method-assign]

    def looks_late() -> float:
        """The time, after another thread has found its moment."""
        stage.clock.now_s = now_s  # type: ignore[method-assign]
        reading.start()
        reading.join(0.2)
        return now_s()

    stage._begin = begins  # type: ignore[method-assign]
    stage.move(0.05, 0.5)
    reading.join()
    while stage.busy:
        stage.clock.wait_until(stage.clock.now_s() + 0.01)
    assert stage.alarm is None
