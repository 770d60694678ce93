"""A simulated camera of which two frames of three never reach the program."""

from typing import Any

from fingervision.testbed.camera import Shot
from fingervision.testbed.cameras import simulated

KEYS = simulated.KEYS
SIMULATED = True


def build(section: Any, context: Any) -> simulated.SimulatedCamera:
    """Build the simulated camera, and throw frames away."""
    camera = simulated.build(section, context)
    take = camera.next

    def third() -> Shot:
        take()
        take()
        return take()

    camera.next = third  # type: ignore[method-assign]
    return camera
