"""`fingervision bed`: commands of the test bed; each module `_bed_NAME.py` in this package is the subcommand NAME."""

import importlib
import pkgutil

import click

import fingervision.cli

PREFIX = "_bed_"


class BedCommands(click.Group):
    """Command group whose subcommands are found by module names, and imported when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the subcommands, sorted."""
        modules = pkgutil.iter_modules(fingervision.cli.__path__)
        return sorted(module.name.removeprefix(PREFIX) for module in modules if module.name.startswith(PREFIX))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import only the module of the requested subcommand."""
        if cmd_name not in self.list_commands(ctx):
            return None
        command = importlib.import_module(f"{fingervision.cli.__name__}.{PREFIX}{cmd_name}").command
        assert isinstance(command, click.Command)  # noqa: S101 - a module without a command is a defect of this package
        return command


EPILOG = """
\b
Examples:
  fingervision bed run recipe.toml --out run
  fingervision bed run recipe.toml --hide backlash:play_mm=0.2 --out hidden
  fingervision bed run next_run.toml --bed lab.toml --out second
  fingervision bed check recipe.toml
"""


@click.group(cls=BedCommands, epilog=EPILOG)
def command() -> None:
    """Run the test bed: actuator, force sensor, camera and gripper, each real or simulated."""
