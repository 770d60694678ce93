"""A hand screw: the questions, the typed answers, and the resulting position."""

from io import StringIO

import numpy as np
import pytest

from fingervision.domain.errors import LimitError, StateError
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.actuators.hand_screw import HandScrew
from fingervision.testbed.clocks.clock import VirtualClock
from fingervision.testbed.terminal import Terminal

LIMITS = StageLimits(lower_mm=-1.0, upper_mm=6.0, speed_mm_s=float("inf"), force_n=float("inf"), accuracy_mm=0.004)


def screw(typed: str) -> tuple[HandScrew, StringIO]:
    screen = StringIO()
    return HandScrew(LIMITS, VirtualClock(), Terminal(StringIO(typed), screen)), screen


def test_the_reading_that_was_typed_is_the_position() -> None:
    actuator, screen = screw("1,252\n")
    actuator.move(1.25, 1.0)
    assert actuator.readings()[-1].value == 1.252
    assert screen.getvalue() == "Turn the screw to 1.250 mm and type its reading in mm (Enter alone: 1.250): "


def test_nothing_lies_between_two_readings() -> None:
    """Interpolation between readings gives the old position until the new position was typed."""
    clock = VirtualClock()
    actuator = HandScrew(LIMITS, clock, Terminal(StringIO("\n"), StringIO()))
    before = actuator.readings()
    clock.wait_until(10.0)
    actuator.move(1.0, 1.0)
    clock.wait_until(11.0)
    readings = (*before, *actuator.readings())
    times, values = [each.device_s for each in readings], [each.value for each in readings]
    assert times == sorted(times)
    assert np.interp([9.99, 10.0, 11.0], times, values).tolist() == [0.0, 1.0, 1.0]


def test_enter_alone_means_that_it_stands_there() -> None:
    actuator, _ = screw("\n")
    actuator.move(1.25, 1.0)
    assert actuator.readings()[-1].value == 1.25


def test_a_slip_of_the_finger_is_asked_for_again() -> None:
    actuator, screen = screw("12.5\none\n3.5\n")
    with pytest.raises(StateError, match=r"^The reading must be typed in mm, but 3 inputs were not valid"):
        actuator.move(1.25, 1.0)
    assert "A reading must lie between -1 and 6 mm, but is 12.5.\n" in screen.getvalue()
    assert "A reading must be a number in mm, but is 'one'.\n" in screen.getvalue()
    assert "The reading must be within 1 mm of 1.250 mm, but is 3.5 mm.\n" in screen.getvalue()
    assert actuator.readings()[-1].value == 0.0


def test_nobody_at_the_terminal_is_said() -> None:
    actuator, _ = screw("")
    with pytest.raises(StateError) as raised:
        actuator.home()
    assert str(raised.value) == (
        "The hand screw must be turned by an operator, but there is no terminal to ask one: "
        "run the command from a terminal."
    )


def test_what_a_hand_cannot_do_is_refused() -> None:
    actuator, screen = screw("0\n")
    with pytest.raises(LimitError, match=r"a jog at 2 mm/s"):
        actuator.jog(2.0)
    with pytest.raises(LimitError, match=r"^Step 3 must be stored in a motor controller, but the hand screw has none"):
        actuator.run_step(3)
    with pytest.raises(LimitError, match=r"^The target must lie between -1 and 6 mm, but is 7 mm: nothing was"):
        actuator.move(7.0, 1.0)
    assert screen.getvalue() == ""
