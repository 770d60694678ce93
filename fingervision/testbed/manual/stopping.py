"""Stop a test bed, also if another process operates it."""

import os
import signal
from time import monotonic, sleep

from fingervision.domain.errors import DeviceError
from fingervision.testbed.bed_factory import SIMULATED, open_bed, read_configuration
from fingervision.testbed.device_kinds import kind_of

LETS_GO_WITHIN_S, STOPS_WITHIN_S = 5.0, 2.0
LOOK_EVERY_S = 0.02


def stop_bed(name: str) -> str:
    """Stop a test bed's motor, and return a sentence that says what was done.

    Parameters
    ----------
    name : str
        `simulated`, or the path of a configuration file.

    Raises
    ------
    DataError, DeviceError, InputFileError, UsageError
        The test bed cannot be opened, or the other process does not release it.
    """
    if name == SIMULATED:
        return "The simulated test bed is at rest: its motor moves only while a command runs."
    top = read_configuration(name)
    section = top.table("actuator")
    find_holder = getattr(kind_of("actuator", section), "holder", None)
    process = None if find_holder is None else find_holder(section, top.path.parent)
    words = ""
    if process is not None:
        os.kill(process, signal.SIGTERM)
        until_s = monotonic() + LETS_GO_WITHIN_S
        while find_holder is not None and find_holder(section, top.path.parent) is not None:
            if monotonic() > until_s:
                raise DeviceError(
                    f"Process {process} must release the test bed within {LETS_GO_WITHIN_S:g} s, but does "
                    "not: switch off the motor's power supply."
                )
            sleep(LOOK_EVERY_S)
        words = f"Process {process}, which operated the test bed, was ended. "
    bed = open_bed(name)
    try:
        bed.actuator.stop()
        until_s = bed.clock.now_s() + STOPS_WITHIN_S
        while bed.actuator.busy:
            if bed.clock.now_s() > until_s:
                raise DeviceError(
                    f"{bed.actuator.name} must be at rest {STOPS_WITHIN_S:g} s after it was told to stop, but reports "
                    "motion: use the emergency stop."
                )
            bed.clock.wait_until(bed.clock.now_s() + LOOK_EVERY_S)
        return f"{words}Stopped: {bed.actuator.name} reports no motion."
    finally:
        bed.close()
