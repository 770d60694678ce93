"""A serial port is for one conversation: its answers would be taken by another."""

import os

import pytest

from fingervision.domain.errors import DeviceError
from fingervision.testbed.serial_port import opened_port


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no pseudo terminals")
def test_a_port_is_opened_once() -> None:
    ends = os.openpty()
    name = os.ttyname(ends[1])
    with opened_port(name, 9600, 0.0), pytest.raises(DeviceError, match="another part of this test bed, has it open"):
        opened_port(name, 9600, 0.0)
    opened_port(name, 9600, 0.0).close()
    for end in ends:
        os.close(end)
