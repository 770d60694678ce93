"""A serial port, opened for one program at a time: why it cannot be opened, and which program has it."""

import errno
import os
from pathlib import Path
from typing import Any

import serial
from serial.tools.list_ports import comports

from fingervision.domain.errors import DeviceError
from fingervision.storage.toml_section import Section

PROGRAM = "fingervision"
WRITE_S = 1.0
# Description that pyserial gives for an unknown port.
UNKNOWN = "n/a"


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


def holder(section: Section, folder: Path) -> int | None:
    """Number of another fingervision process that has the `port` of a device open; None if none has, or it has none."""
    port = section.values.get("port")
    return fingervision_at(port) if isinstance(port, str) else None


def opened_port(name: str, baud: int, read_s: float, **options: Any) -> serial.Serial:
    """Open a serial port for exclusive use, by its name or by a pyserial address such as `socket://host:port`.

    Parameters
    ----------
    name : str
        Name of the port.
    baud : int
        Speed.
    read_s : float
        Time that a reading waits for bytes.
    **options
        Further properties, as pyserial names them.

    Raises
    ------
    DeviceError
        There is no such port, another program has it, or this user may not open it.
    """
    try:
        return serial.serial_for_url(
            name, baudrate=baud, timeout=read_s, write_timeout=WRITE_S, exclusive=True, **options
        )
    except serial.SerialException as error:
        raise DeviceError(_why_closed(name, error)) from error
    except (OSError, ValueError) as error:
        raise DeviceError(f"The port must be a serial port, but is {name!r} ({error}).") from error


def _why_closed(name: str, error: serial.SerialException) -> str:
    # A lock of another program is reported as EAGAIN; Windows reports "access denied" without a number.
    if error.errno in (errno.EAGAIN, errno.EBUSY) or "Could not exclusively lock" in str(error):
        holders = ", ".join(f"process {process}" for process in holders_of(name))
        if holders:
            return (
                f"The port {name} must be free, but another program ({holders}) has it open: close that program first."
            )
        # Two conversations on one line would take each other's answers.
        return (
            f"The port {name} must be free, but another program, or another part of this test bed, has it open: close "
            "that program first, or give each part a port of its own."
        )
    if error.errno in (errno.EACCES, errno.EPERM):
        return (
            f"The port {name} must be open to this user, but access was denied: join the group that owns it (on Debian "
            "`sudo adduser $USER dialout`, then log in again), or close the program that has it."
        )
    ports = found_ports()
    there = ", ".join(port if words == UNKNOWN else f"{port} ({words})" for port, words in ports)
    hint = f"; those of this machine are {there}" if ports else "; this machine has none: plug the device in"
    if error.errno in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"There is no serial port {name}{hint}."
    return f"The port {name} could not be opened ({error}){'' if '://' in name else hint}."


def told(port: Any, data: bytes) -> None:
    """Send bytes to a serial port by one write.

    Raises
    ------
    DeviceError
        The port took nothing for its time limit.
    """
    try:
        port.write(data)
    except serial.SerialTimeoutException as error:
        raise DeviceError(
            f"The device at {port.port} must take what it is told within {WRITE_S:g} s, but did not: switch it on, and "
            "check its cable and its flow control (rtscts, xonxoff)."
        ) from error
