"""What every test shares: one hypothesis profile, so that the same commit always tests the same examples; Ctrl-C.

With `-n`, each worker gets tests in a row and takes from others when it has none left, so that a fixture of a module is
made once and not by every worker.
"""

import signal
from typing import Any

import pytest
from hypothesis import settings

# No deadline: the machines that run this differ tenfold in speed. Derandomised: a failure is the commit's, not luck's.
settings.register_profile("fixed", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("fixed")

# A shell lets jobs in the background ignore Ctrl-C, and they their children; tests that press it need it to be heard.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Distribute as `--dist worksteal` does, unless something else is asked for."""
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log) if config.getvalue("dist") == "load" else None
