"""The options that say which model a measurement is held against."""

from pathlib import Path

import click

from fingervision.cli._kind_choice import KindChoice

HELP = "Simulation .csv, gripper.toml, model.toml, .fmu, or .py with simulate(time_s, input_mm)"


def _single(context: click.Context, parameter: click.Parameter, value: tuple[Path, ...]) -> Path:
    """Take one model; of several, none may be left out in silence."""
    if len(value) > 1:
        raise click.BadParameter(
            f"one model is diagnosed at a time, but {len(value)} were given: `fingervision compare` takes several.",
            context,
            parameter,
        )
    return value[0]


model_option = click.option(
    "--model",
    "model_path",
    required=True,
    multiple=True,
    callback=_single,
    type=click.Path(path_type=Path),
    help=f"{HELP}.",
)
models_option = click.option(
    "--model",
    "model_paths",
    required=True,
    multiple=True,
    type=click.Path(path_type=Path),
    help=f"{HELP}; several are compared in one figure.",
)


def told_apart(paths: tuple[Path, ...]) -> list[str]:
    """Name models by their files, with as much of the folder as tells them apart."""
    for parts in range(1, max(len(path.parts) for path in paths) + 1):
        names = [Path(*path.parts[-parts:]).as_posix() for path in paths]
        if len(set(names)) == len(names):
            return names
    raise click.UsageError("--model names the same file twice: each model counts once.")


kind_option = click.option(
    "--kind",
    type=KindChoice(),
    default="lumped",
    show_default=True,
    help="Which model answers for a gripper.toml.",
)
