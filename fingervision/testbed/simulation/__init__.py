"""Components of simulated parts: stage, gripper, clocks, optics. Neither hardware nor diagnosis imports them."""
