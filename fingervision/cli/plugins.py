"""`fingervision plugins`: list every part that plug-ins can add, and where it comes from."""

from typing import Any

import click

from fingervision.cli._command import OUTPUT, make_command, option
from fingervision.cli._options import json_option

EXAMPLES = """
\b
Examples:
  fingervision plugins
  fingervision plugins --all
  fingervision plugins --json

\b
A distribution adds a part by an entry point of its group:
  fingervision.effects        fingervision.models    fingervision.frame_sources  fingervision.report_parts
  fingervision.actuators      fingervision.cameras   fingervision.force_sensors
A Python file adds a part without installation: --effects FILE.py, or kind = "./FILE.py" in a bed.toml. The README.md of
fingervision/plugins says what each part must define; fingervision.testing has the tests that every part passes.
"""


@make_command(EXAMPLES)
@option("--all", "every", is_flag=True, group=OUTPUT, help="Also list built-in parts.")
@json_option("Print the list as JSON, with built-in parts.")
def command(every: bool, as_json: bool) -> None:
    """List the installed plug-ins with their origin, and those that could not be used with the reason."""
    import json

    rows: list[dict[str, Any]] = []
    refused: list[dict[str, str]] = []
    for registry in _registries():
        rows += [
            {"group": registry.group, "name": entry.name, "from": str(entry.origin), "built_in": entry.origin.built_in}
            for entry in registry.entries()
        ]
        refused += [
            {"group": registry.group, "name": one.name, "from": str(one.origin), "why": one.sentence}
            for one in registry.refusals()
        ]
    if as_json:
        click.echo(json.dumps({"schema": 1, "parts": rows, "left_out": refused}, indent=2))
        return
    shown = [row for row in rows if every or not row["built_in"]]
    for row in shown:
        click.echo(f"{row['group'].removeprefix('fingervision.'):14} {row['name']:24} {row['from']}")
    if not rows or (not shown and not refused):
        click.echo("No plug-in is installed; --all also lists the built-in parts.")


def _registries() -> list[Any]:
    from fingervision.diagnosis.report import report_parts
    from fingervision.effects import REGISTRY as EFFECTS
    from fingervision.frames.source_kinds import REGISTRY as SOURCES
    from fingervision.models.kinds import REGISTRY as MODELS
    from fingervision.testbed.device_kinds import REGISTRIES

    return [EFFECTS, MODELS, SOURCES, *REGISTRIES.values(), report_parts.REGISTRY]
