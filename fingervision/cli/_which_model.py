"""The options that say which model a measurement is held against."""

from pathlib import Path

import click

model_option = click.option(
    "--model",
    "model_path",
    required=True,
    type=click.Path(path_type=Path),
    help="Simulation .csv, gripper.toml, model.toml, .fmu, or a .py with simulate(time_s, input_mm).",
)
kind_option = click.option(
    "--kind",
    type=click.Choice(["stiffness_matrix", "lumped", "finite_element"]),
    default="lumped",
    show_default=True,
    help="Which model answers for a gripper.toml.",
)
