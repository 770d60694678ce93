"""Gripper models, one a file: input displacement in, gap out."""
