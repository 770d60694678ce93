"""What every test shares: one hypothesis profile, so that the same commit always tests the same examples; Ctrl-C."""

import signal

from hypothesis import settings

# No deadline: the machines that run this differ tenfold in speed. Derandomised: a failure is the commit's, not luck's.
settings.register_profile("fixed", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("fixed")

# A shell lets jobs in the background ignore Ctrl-C, and they their children; tests that press it need it to be heard.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
