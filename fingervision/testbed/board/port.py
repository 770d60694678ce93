"""The serial port to which a board is connected."""

import errno
import os
from pathlib import Path

import serial
from serial.tools.list_ports import comports

from fingervision.domain.errors import DeviceError

BAUD = 115200
PROGRAM = "fingervision"
# Description that pyserial gives for an unknown port.
UNKNOWN = "n/a"
# Longest wait for input in the link's thread, which must send messages regularly to keep the board awake.
READ_TIMEOUT_S = 0.005
WRITE_TIMEOUT_S = 1.0


def found_ports() -> tuple[tuple[str, str], ...]:
    """Names of this machine's serial ports, each with the device connected to it."""
    return tuple(sorted((port.device, port.description) for port in comports()))


def holders_of(name: str) -> tuple[int, ...]:
    """Other processes of this user that have a port open; on systems other than Linux none are found."""
    port = Path(name).resolve()
    holders = []
    for folder in Path("/proc").glob("[0-9]*/fd"):
        process = int(folder.parent.name)
        try:
            if process != os.getpid() and any(file.readlink() == port for file in folder.iterdir()):
                holders.append(process)
        except OSError:  # the process has ended, or belongs to another user
            continue
    return tuple(sorted(holders))


def fingervision_at(name: str) -> int | None:
    """Number of another fingervision process that has a port open and can be asked to end; None if none has."""
    for process in holders_of(name):
        try:
            words = Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if any(Path(os.fsdecode(word)).name in (PROGRAM, f"{PROGRAM}.exe") for word in words):
            return process
    return None


def opened_port(name: str) -> serial.Serial:
    """Open a serial port for exclusive use.

    Raises
    ------
    DeviceError
        There is no such port, another program has it, or this user may not open it.
    """
    try:
        return serial.Serial(name, BAUD, timeout=READ_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S, exclusive=True)
    except ValueError as error:
        raise DeviceError(f"The board's port must be a serial port, but is {name!r} ({error}).") from error
    except serial.SerialException as error:
        raise DeviceError(_why_closed(name, error)) from error


def _why_closed(name: str, error: serial.SerialException) -> str:
    # A lock of another program is reported as EAGAIN; Windows reports "access denied" without a number.
    if error.errno in (errno.EAGAIN, errno.EBUSY) or "Could not exclusively lock" in str(error):
        holders = ", ".join(f"process {process}" for process in holders_of(name))
        who = f"another program ({holders})" if holders else "another program"
        return f"The port {name} must be free, but {who} has it open: close that program first."
    if error.errno in (errno.EACCES, errno.EPERM):
        return (
            f"The port {name} must be open to this user, but access was denied: join the group that owns it (on Debian "
            "`sudo adduser $USER dialout`, then log in again), or close the program that has it."
        )
    ports = found_ports()
    there = ", ".join(port if words == UNKNOWN else f"{port} ({words})" for port, words in ports)
    hint = f"; those of this machine are {there}" if ports else "; this machine has none: plug the board in"
    if error.errno in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"There is no serial port {name}{hint}."
    return f"The port {name} could not be opened as a serial port ({error}){hint}."
