"""Options that choose the model with which a measurement is compared."""

import os
from pathlib import Path
from typing import Any

import click

from fingervision.cli._kind_choice import KindChoice

HELP = "Simulation .csv, gripper.toml, model.toml, .fmu, or .py with simulate(time_s, input_mm)"


def _single(context: click.Context, parameter: click.Parameter, value: tuple[Path, ...]) -> Path:
    """Return the single model of an option; more than one is refused, so that no model is silently ignored."""
    if len(value) > 1:
        raise click.BadParameter(
            f"one model is diagnosed at a time, but {len(value)} were given: `fingervision compare` takes several.",
            context,
            parameter,
        )
    return value[0]


class ModelPath(click.Path):
    """Path of a model; `model.py:simulate` means the file model.py."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path of the model's file."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if ".py:" not in path.name:
            return path
        from fingervision.models.function_model import model_file

        return model_file(path)


model_option = click.option(
    "--model",
    "model_path",
    required=True,
    multiple=True,
    callback=_single,
    type=ModelPath(),
    help=f"{HELP}.",
)
models_option = click.option(
    "--model",
    "model_paths",
    required=True,
    multiple=True,
    type=ModelPath(),
    help=f"{HELP}; several are compared in one figure.",
)


kind_option = click.option(
    "--kind",
    type=KindChoice(),
    default="lumped",
    show_default=True,
    help="Kind of model by which a gripper.toml is computed.",
)
