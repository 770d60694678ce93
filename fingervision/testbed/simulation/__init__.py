"""What simulated parts are made of: stage, gripper, clocks, optics. No hardware and no diagnosis knows of them."""
