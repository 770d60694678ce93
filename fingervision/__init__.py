"""Measure a compliant gripper's finger gap in video, and explain where simulation and measurement disagree."""

__version__ = "0.2.0"
