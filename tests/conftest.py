"""What every test shares: one hypothesis profile, so that the same commit always tests the same examples."""

from hypothesis import settings

# No deadline: the machines that run this differ tenfold in speed. Derandomised: a failure is the commit's, not luck's.
settings.register_profile("fixed", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("fixed")
