"""A model of a gripper is built once for all tests of a process: that takes as long as the rest of many a test."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from fingervision.models.kinds import GripperModel, build_model


@contextmanager
def one_model_each(where: str) -> Iterator[None]:
    """Remember what `build_model` gives at the place where it is called, and for what."""
    known: list[tuple[object, GripperModel]] = []

    def build(*given: object) -> GripperModel:
        found = next((model for before, model in known if before == given), None)
        if found is None:
            found = build_model(*given)  # type: ignore[arg-type]
            known.append((given, found))
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(where, build)
        yield
