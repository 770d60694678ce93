"""A motor record of EPICS by its name, over Channel Access by caproto; needs the extra `epics`.

Fields as in the EPICS motor record (epics-modules.github.io/motor): VAL, RBV, VELO, STOP, DMOV, SPMG, LLM, HLM,
HOMF, HOMR. caproto is chosen because it is pure Python (1 MB, BSD licence); its addresses come from EPICS_CA_ADDR_LIST
as for every client. Tested against the motor record that caproto's project simulates, not against a controller.
"""

from collections.abc import Mapping
from typing import Any

from fingervision.domain.errors import DeviceError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError, in_a_line
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import (
    AxisSettings,
    SingleAxis,
    stated_axis,
    without_hardware,
)
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock

__all__ = ["KEYS", "SIMULATED", "MotorRecord", "build", "without_hardware"]
KEYS = ("record", "home", "units_per_mm", *AXIS)
SIMULATED = False
FIELDS = ("VAL", "RBV", "VELO", "STOP", "DMOV", "SPMG", "LLM", "HLM", "HOMF", "HOMR")
HOMES = {"forward": "HOMF", "reverse": "HOMR", "zero": ""}
STOPPED, PAUSED = 0, 1  # SPMG: Stop, Pause, Move, Go
CONNECTS_S, ANSWER_S = 5.0, 2.0
# DMOV falls when the record is processed: within the scan of a slow server.
BEGINS_S = 0.15
# A record that holds a speed below this share of what was written has limited it; the rest is rounding.
SLOWER = 0.99


class MotorRecord(SingleAxis):
    """A motor record.

    Parameters
    ----------
    context : caproto.threading.client.Context
        The client, to be closed at the end.
    fields : mapping of str to caproto PV
        Connected fields by name.
    record, home : str
        Name of the record, and the field that begins to search the reference; empty for none.
    units_per_mm : float
        Engineering units (EGU) in a millimetre.
    clock, settings
        As in `SingleAxis`.
    """

    def __init__(
        self, context: Any, fields: Mapping[str, Any], record: str, home: str, units_per_mm: float, clock: Clock,
        settings: AxisSettings,
    ) -> None:  # fmt: skip
        super().__init__(f"motor record {record}", clock, settings)
        self._context, self._fields, self._home, self._per_mm = context, fields, home, units_per_mm
        self._began_s = -BEGINS_S

    def _set_up(self) -> None:
        settings = self._settings
        low, high = (self._asked(lambda name=name: self._get(name)) for name in ("LLM", "HLM"))  # type: ignore[misc]
        ends = [(settings.zero_mm + settings.sign * mm) * self._per_mm
                for mm in (settings.limits.lower_mm, settings.limits.upper_mm)]  # fmt: skip
        # Equal limits switch the record's check off.
        if low != high and not low - 1e-9 <= min(ends) <= max(ends) <= high + 1e-9:
            raise DeviceError(
                f"The range {min(ends):g} to {max(ends):g} of {self.name} must lie within the record's own limits "
                f"{low:g} to {high:g} (LLM, HLM), but does not: change lower_mm, upper_mm or zero_mm."
            )

    def _get(self, field: str) -> float:
        return float(self._fields[field].read(timeout=ANSWER_S).data[0])

    def _set(self, field: str, value: float, *, wait: bool = False) -> None:
        self._fields[field].write([value], wait=wait, timeout=ANSWER_S)

    def _moving(self) -> bool:
        return self._clock.now_s() - self._began_s < BEGINS_S or self._get("DMOV") == 0.0

    def _position_mm(self) -> float:
        return self._get("RBV") / self._per_mm

    def _go_home(self) -> None:
        if self._home:
            self._set(self._home, 1)
            self._began_s = self._clock.now_s()

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        if (state := self._get("SPMG")) in (STOPPED, PAUSED):
            raise RefusedError("SPMG", f"that it is {'stopped' if state == STOPPED else 'paused'} (SPMG): set it to Go")
        self._set("VELO", speed_mm_s * self._per_mm, wait=True)
        if (held := self._get("VELO") / self._per_mm) < SLOWER * speed_mm_s:
            raise RefusedError("VELO", f"a speed of at most {held:g} mm/s (VMAX) when it was told {speed_mm_s:g} mm/s")
        self._set("VAL", to_mm * self._per_mm)
        self._began_s = self._clock.now_s()

    def _halt(self) -> None:
        self._set("STOP", 1)

    def _release(self) -> None:
        self._context.disconnect()


def build(section: Section, context: BuildContext) -> MotorRecord:
    """Connect to the record that the configuration states."""
    try:
        from caproto.threading.client import Context
    except ImportError as error:
        section.refuse("kind", f"needs caproto, which is not installed ({error}): pip install 'fingervision[epics]'.")
    settings, record = stated_axis(section), section.word("record")
    home, per_mm = HOMES[section.word("home", "zero", of=HOMES)], section.number("units_per_mm", 1.0, above=0.0)
    client = Context()
    try:
        found = client.get_pvs(*(f"{record}.{field}" for field in FIELDS))
        for each in found:
            each.wait_for_connection(timeout=CONNECTS_S)
    except Exception as error:
        client.disconnect()
        section.refuse("record", f"must be a motor record in the network, but {record} is none ({in_a_line(error)}).")
    fields = dict(zip(FIELDS, found, strict=True))
    return MotorRecord(client, fields, record, home, per_mm, context.clock, settings).at_rest()
