"""The test bed: actuator, force sensor, camera and gripper as one experiment, each real or simulated."""
