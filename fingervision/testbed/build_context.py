"""Information shared by the builders of a bed's devices while the bed is built."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingervision.measuring.scale import Scale
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.soft_limits import SoftLimits
from fingervision.testbed.simulation.gripper import Motion, SimulatedGripper
from fingervision.testbed.simulation.injected_effects import Hidden


@dataclass(slots=True)
class BuildContext:
    """The bed under construction: actuator first, then gripper, force sensor and camera.

    Parameters
    ----------
    clock : Clock
        The bed's time.
    folder : Path
        Where relative names in the configuration begin.
    seed : int
        Of everything random in simulated parts.
    hidden : Hidden
        Effects that act in simulated parts without the rest knowing.
    limits : SoftLimits
        Of the bed.
    scale : Scale or None
        Of the camera, as the configuration states it.
    below_tip_mm : float
        Height of measuring.
    since_s : float or None
        Since when a simulated gripper warms and drifts, on the bed's clock; None where the bed begins anew.
    motion : Motion or None
        What a simulated gripper is driven by; a simulated actuator puts it here.
    play_mm : float
        Play of a simulated drive.
    gripper : SimulatedGripper or None
        The simulated gripper, for the parts that look at it or push it.
    shared : dict
        Things that several parts are made from, by name: a board behind a port.
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
