"""Components of simulated parts: stage, gripper, clocks, optics.

Drivers of hardware do not import these modules directly.
"""
