"""Information used by the builders of a test bed's devices while the test bed is built."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingervision.measuring.scale import Scale
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.simulation.gripper import Motion, SimulatedGripper
from fingervision.testbed.simulation.injected_effects import Hidden


@dataclass(slots=True)
class BuildContext:
    """Context of a device's builder: the parts built so far, in the order actuator, gripper, force sensor, camera.

    Parameters
    ----------
    clock : Clock
        Clock of the test bed.
    folder : Path
        Folder to which relative paths in the configuration refer.
    seed : int
        Seed of everything random in simulated parts.
    hidden : Hidden
        Effects that are injected into simulated parts; the other parts do not know them.
    limits : SoftLimits
        Soft limits of the test bed.
    scale : Scale or None
        Scale of the camera, if stated in the configuration.
    below_tip_mm : float
        Distance of the measuring point below each finger's tip.
    since_s : float or None
        Time on the test bed's clock since which a simulated gripper has been warming and drifting; None for a new
        start.
    motion : Motion or None
        Motion that drives a simulated gripper; a simulated actuator sets it.
    play_mm : float
        Play of a simulated drive.
    gripper : SimulatedGripper or None
        The simulated gripper, for parts that view or load it.
    shared : dict
        Objects used by several parts, by name, such as a board behind a port.
    """

    clock: Clock
    folder: Path
    seed: int
    hidden: Hidden
    limits: SoftLimits
    scale: Scale | None
    below_tip_mm: float
    since_s: float | None = None
    motion: Motion | None = None
    play_mm: float = 0.0
    gripper: SimulatedGripper | None = None
    shared: dict[str, Any] = field(default_factory=dict)
