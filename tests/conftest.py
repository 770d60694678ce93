"""What every test shares: one hypothesis profile, so that the same commit always tests the same examples; Ctrl-C."""

import signal
import sys
from collections.abc import Iterator

import pytest
from hypothesis import settings

# No deadline: the machines that run this differ tenfold in speed. Derandomised: a failure is the commit's, not luck's.
settings.register_profile("fixed", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("fixed")

# A shell lets jobs in the background ignore Ctrl-C, and they their children; tests that press it need it to be heard.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _no_effect_of_a_test_outlives_it() -> Iterator[None]:
    """Take back the effects that a test registered for the session: a command run in the test's process may do so."""
    yield
    effects = sys.modules.get("fingervision.effects")
    if effects is None:
        return
    for name in [name for name in effects.catalogue() if str(effects.origin_of(name)) == "this session"]:
        effects.withdraw(name)
