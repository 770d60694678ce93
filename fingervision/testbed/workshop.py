"""What the builders of a bed's parts share while it is put together."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingervision.testbed.clock import Clock
from fingervision.testbed.hidden import Hidden


@dataclass(slots=True)
class Workshop:
    """The bed while it is being put together; builders may put into `shared` what another part needs.

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
    shared : dict
        Things that several parts are made from, by name: a board behind a port, the simulated stage and gripper.
    """

    clock: Clock
    folder: Path
    seed: int
    hidden: Hidden
    shared: dict[str, Any] = field(default_factory=dict)
