"""Fixtures for tests of stages behind emulated controllers."""

import pytest

from tests.testbed.stages.emulators import virtual_time


@pytest.fixture
def virtual(monkeypatch: pytest.MonkeyPatch) -> None:
    """Test beds and emulators share a virtual clock, and talk over wires; every controller is ready at once."""
    monkeypatch.setattr("fingervision.testbed.text_protocol.line.sleep", lambda seconds: None)
    virtual_time(monkeypatch)
