"""Options that state properties of the bench that no picture shows and the uncertainty budget needs."""

from collections.abc import Callable
from typing import Any

import click

# Option, name in calib.limits.Limits, default there (a test holds the two equal), what it is.
LIMITS = (
    ("--plane-mm", "plane_mm", 0.5, "Gripper out of the reference's plane by up to +- this, mm."),
    ("--camera-distance-mm", "camera_distance_mm", 100.0, "Camera's distance from that plane, mm."),
    ("--tilt-deg", "tilt_deg", 2.0, "Plane tilted by up to +- this, degrees."),
    ("--lens-relative", "lens_relative", 0.001, "Distortion left, up to +- this part of the radius at the corner."),
    ("--edge-bias-px", "edge_bias_px", 0.6, "Blooming of both edges together where no reference tells, up to +-, px."),
    ("--estimator-px", "estimator_px", 0.02, "Phase bias of each edge, up to +-, px."),
    ("--temperature-k", "temperature_k", 2.0, "Reference warmer or colder than its certificate by up to +- this, K."),
    ("--expansion-per-k", "expansion_per_k", 11.5e-6, "Thermal expansion of the reference (steel), 1/K."),
)

Command = Callable[..., Any]


def limit_options(command: Command) -> Command:
    """Add one option for every limit."""
    for option, name, default, words in reversed(LIMITS):
        text = f"{words}  [default: {default:g}]"
        command = click.option(option, name, type=float, default=None, help=text)(command)
    return command
