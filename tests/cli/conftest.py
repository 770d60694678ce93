"""Fixtures for tests of commands."""

from collections.abc import Iterator

import pytest

from tests.one_model_each import one_model_each


@pytest.fixture(scope="session", autouse=True)
def _one_model_of_each_gripper() -> Iterator[None]:
    with one_model_each("fingervision.interface.prediction.build_model"):
        yield
