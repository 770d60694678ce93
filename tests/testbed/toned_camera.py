"""A camera with the tone curve of sRGB before the simulated gripper, which nobody has stated."""

from typing import Any

import numpy as np

from fingervision.testbed.cameras import simulated

KEYS = simulated.KEYS
SIMULATED = True
GAMMA_BELOW, SLOPE, GAMMA = 0.0031308, 12.92, 2.4


def build(section: Any, context: Any) -> simulated.SimulatedCamera:
    """Build the simulated camera, and let it store sRGB's levels."""
    camera = simulated.build(section, context)
    draw = camera.draw

    def toned(*exposure: Any) -> Any:
        light = draw(*exposure) / 255.0
        curve = np.where(light <= GAMMA_BELOW, SLOPE * light, 1.055 * light ** (1.0 / GAMMA) - 0.055)
        return np.rint(255.0 * curve).astype(np.uint8)

    camera.draw = toned  # type: ignore[method-assign]
    return camera
