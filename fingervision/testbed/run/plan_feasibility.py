"""Check that the actuator can make every motion of a plan from the end of the previous one."""

from math import tau

from fingervision.domain.errors import FingervisionError, LimitError
from fingervision.testbed.actuator import MoveCheck
from fingervision.testbed.motion.soft_limits import SoftLimits
from fingervision.testbed.run.motion_segments import Close, Go, Rezero, Swing
from fingervision.testbed.run.plan import Plan


def check_moves(plan: Plan, actuator: MoveCheck, limits: SoftLimits, at_mm: float) -> None:
    """Refuse a plan that the actuator cannot execute: a motor controller can only move to the targets of its step data.

    Raises
    ------
    LimitError
        With the line of the recipe, and the actuator's reason.
    """
    for leg in plan.legs:
        to_mm, speed_mm_s = at_mm, 0.0
        match leg.act:
            case Go(to, speed):
                to_mm, speed_mm_s = to, speed
            case Swing(mean, amplitude, frequency_hz):
                if actuator.has_steps:
                    raise LimitError(
                        f"kind in {leg.section.at('kind')} cannot be executed: a sine consists of many short moves to "
                        "intermediate positions, but this actuator can only move to the target positions of its step "
                        "data. Use a triangle or a staircase between two target positions of the step data. Nothing "
                        "was moved."
                    )
                to_mm, speed_mm_s = mean + amplitude, tau * frequency_hz * abs(amplitude)
            case Close(speed):
                to_mm, speed_mm_s = limits.lower_mm, speed
            case Rezero():
                at_mm = 0.0
                continue
        if to_mm == at_mm:
            continue
        try:
            actuator.check(at_mm, to_mm, speed_mm_s)
        except FingervisionError as error:
            raise LimitError(f"{leg.key} in {leg.section.at(leg.key)} cannot be executed: {error}") from error
        at_mm = to_mm
