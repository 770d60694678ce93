"""The test bed: actuator, force sensor, camera and gripper as one experiment, each part real or simulated."""
