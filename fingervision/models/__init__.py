"""Models of the gripper, one kind per module: each predicts the gap from the input displacement."""
