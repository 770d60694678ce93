"""Gripper models, one per file: input displacement in, gap out."""
