"""An axis of a device that is set to positions: at its own speed if it can be told one, else along a ramp of positions.

The ramp needs no thread: the position that is due is sent whenever the stage is looked at, which a test bed does at
each frame and every 20 ms while it waits. If the program is killed, the stage therefore stands still.
"""

from abc import abstractmethod

from fingervision.testbed.actuators._single_axis import SingleAxis


class SetpointAxis(SingleAxis):
    """A `SingleAxis` whose subclass states whether the device takes a speed, and how it is set to a position."""

    # Begin, end, speed and time of the beginning of the ramp.
    _ramp: tuple[float, float, float, float] | None = None

    @abstractmethod
    def _takes_speed(self, speed_mm_s: float) -> bool:
        """Tell the device the speed of the next motion; return False if it cannot be told."""

    @abstractmethod
    def _put(self, to_mm: float) -> None:
        """Begin to move to a position."""

    @abstractmethod
    def _settled(self) -> bool:
        """Whether the device has reached the position to which it was set last."""

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        if self._takes_speed(speed_mm_s):
            self._put(to_mm)
        else:
            self._ramp = (self._position_mm(), to_mm, speed_mm_s, self._clock.now_s())

    def _moving(self) -> bool:
        ramp, stops = self._ramp, self._stops
        if not self._settled():
            return True
        if ramp is None:
            return False
        from_mm, to_mm, speed_mm_s, began_s = ramp
        left = 1.0 - speed_mm_s * (self._clock.now_s() - began_s) / max(abs(to_mm - from_mm), 1e-12)
        self._put(to_mm - max(left, 0.0) * (to_mm - from_mm))
        if left <= 0.0:
            self._ramp = None
        if self._stops != stops:  # a stop came while the position was being sent
            self._halt()
        return True
