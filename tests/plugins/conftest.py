"""Every test sees the installed plug-ins anew, and leaves none behind."""

import sys
from collections.abc import Iterator

import pytest

from fingervision.effects import REGISTRY


@pytest.fixture(autouse=True)
def _anew() -> Iterator[None]:
    before = set(sys.modules)
    REGISTRY.forget()
    yield
    REGISTRY.forget()
    for name in set(sys.modules) - before:
        if name.startswith(("fvdemo", "_fingervision_file")):
            del sys.modules[name]
