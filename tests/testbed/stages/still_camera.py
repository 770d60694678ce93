"""A camera of the simulated gripper that always shows the same picture: drawing each frame would take longest here."""

from typing import Any

from fingervision.testbed.cameras import simulated

KEYS = simulated.KEYS
SIMULATED = True


def build(section: Any, context: Any) -> simulated.SimulatedCamera:
    """Build the simulated camera, and let it draw once."""
    camera = simulated.build(section, context)
    draw, drawn = camera.draw, []

    def once(*exposure: Any) -> Any:
        drawn[:] = drawn or [draw(*exposure)]
        return drawn[0]

    camera.draw = once  # type: ignore[method-assign]
    return camera
