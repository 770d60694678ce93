"""Every kind of source fulfils the contract, tested with a recording that it can open."""

from contextlib import suppress
from pathlib import Path

import pytest

from fingervision.frames.source_kinds import REGISTRY
from fingervision.testing import FrameSourceContract, NotApplicable, checks_of
from fingervision.testing.frame_source_contract import NOWHERE

SAMPLES = Path(__file__).parents[2] / "sample_frames"
VIDEOS = sorted(path for path in SAMPLES.glob("*/*") if path.suffix in (".mp4", ".mkv", ".avi"))
FOLDERS = sorted(
    {path.parent for path in SAMPLES.glob("*/*/*.png")} | {path.parent for path in SAMPLES.glob("*/*.png")}
)
CANDIDATES = ("simulated", *(str(path) for path in (*VIDEOS, *FOLDERS)))


@pytest.mark.parametrize("kind", REGISTRY.names())
@pytest.mark.parametrize("check", checks_of(FrameSourceContract))
def test_every_source_keeps_the_contract(kind: str, check: str) -> None:
    contract = FrameSourceContract()
    contract.kind = REGISTRY.get(kind).value
    assert not any(contract.kind.accepts(name) for name in NOWHERE)
    name = next((name for name in CANDIDATES if contract.kind.accepts(name)), None)
    if name is None:
        pytest.skip("it opens what is not here: a camera, a stream")
    contract.name = name
    with suppress(NotApplicable):
        getattr(contract, check)()
