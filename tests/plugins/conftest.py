"""Fixture: every test searches for installed plug-ins again, and removes those that it adds."""

import sys
from collections.abc import Iterator

import pytest

from fingervision.diagnosis.report import report_parts
from fingervision.effects import REGISTRY
from fingervision.frames import source_kinds
from fingervision.models import kinds
from fingervision.testbed.device_kinds import REGISTRIES


@pytest.fixture(autouse=True)
def _anew() -> Iterator[None]:
    registries = (REGISTRY, kinds.REGISTRY, source_kinds.REGISTRY, report_parts.REGISTRY, *REGISTRIES.values())
    before = set(sys.modules)
    for registry in registries:
        registry.forget()  # type: ignore[attr-defined]
    yield
    for registry in registries:
        registry.forget()  # type: ignore[attr-defined]
    for name in set(sys.modules) - before:
        if name.startswith(("fvdemo", "_fingervision_file")):
            del sys.modules[name]
