"""Options for properties of the set-up that the uncertainty budget needs and that no picture shows."""

from collections.abc import Callable
from typing import Any

import click

from fingervision.cli._number import NUMBER

# Option; name and default in calib.limits.Limits (a test compares the defaults); description.
LIMITS = (
    ("--plane-mm", "plane_mm", 0.5, "Largest distance of the gripper from the plane of the reference, +- mm."),
    (
        "--camera-distance-mm",
        "camera_distance_mm",
        100.0,
        "Distance of the camera from the plane of the reference, mm.",
    ),
    ("--tilt-deg", "tilt_deg", 2.0, "Largest tilt of the plane, +- degrees."),
    (
        "--lens-relative",
        "lens_relative",
        0.001,
        "Largest residual lens distortion, +-, as a fraction of the distance from centre to corner.",
    ),
    (
        "--edge-bias-px",
        "edge_bias_px",
        0.6,
        "Largest edge bias (both edges together) if no reference determines it, +- px.",
    ),
    ("--estimator-px", "estimator_px", 0.02, "Largest sub-pixel phase bias of the fit of each edge, +- px."),
    (
        "--temperature-k",
        "temperature_k",
        2.0,
        "Largest deviation of the reference's temperature from its certificate's, +- K.",
    ),
    ("--expansion-per-k", "expansion_per_k", 11.5e-6, "Thermal expansion of the reference (steel), 1/K."),
)

Command = Callable[..., Any]


def limit_options(command: Command) -> Command:
    """Add one option for the limit of each property of the set-up that the uncertainty budget needs."""
    for option, name, default, words in reversed(LIMITS):
        text = f"{words}  [default: {default:g}]"
        command = click.option(option, name, type=NUMBER, default=None, help=text)(command)
    return command
