"""Components of simulated parts: stage, gripper, clocks, optics. No hardware module imports these."""
