"""Requirements on every parametric model, including models that are added later."""

from contextlib import suppress

import pytest

from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper
from fingervision.domain.model import Model
from fingervision.models.answer_figures import LINEAR
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import REGISTRY, build_model, kinds
from fingervision.testing import ModelContract, NotApplicable, checks_of


@pytest.mark.parametrize("check", checks_of(ModelContract))
@pytest.mark.parametrize("kind", kinds())
def test_every_kind_keeps_the_contract(kind: str, check: str) -> None:
    contract = ModelContract()
    contract.kind = REGISTRY.get(kind).value
    with suppress(NotApplicable):
        getattr(contract, check)()


@pytest.mark.parametrize("kind", kinds())
def test_every_kind_is_a_model(gripper: Gripper, kind: str) -> None:
    assert isinstance(build_model(kind, gripper, LINEAR, HingeTheory.CORRECTED), Model)


def test_an_unknown_kind_is_refused(gripper: Gripper) -> None:
    with pytest.raises(UsageError, match=r"must be one of .*, but is comsol"):
        build_model("comsol", gripper, LINEAR, HingeTheory.BEAM)
