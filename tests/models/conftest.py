from pathlib import Path

import pytest

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.lumped import LumpedGripper
from fingervision.storage.gripper_toml import read_gripper

REFERENCE = Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml"


@pytest.fixture(scope="session")
def gripper() -> Gripper:
    return read_gripper(REFERENCE)


@pytest.fixture(scope="session")
def finite_element(gripper: Gripper) -> FiniteElementGripper:
    return FiniteElementGripper(gripper)


@pytest.fixture(scope="session")
def lumped(gripper: Gripper) -> LumpedGripper:
    return LumpedGripper(gripper)
