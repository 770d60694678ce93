"""A recipe in a process of its own, which can be killed; forked from a server that has imported everything once."""

import multiprocessing
import os
from collections.abc import Callable, Mapping
from multiprocessing.process import BaseProcess
from pathlib import Path

from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.run.recipe_run import RunDone, run_recipe
from fingervision.testbed.text_protocol import line


def run(recipe: Path, bed_toml: Path, out: Path, on_row: Callable[[int], None] = lambda number: None) -> RunDone:
    """Run a recipe on a test bed; `on_row` is called with the number of rows that this call has written."""
    bed, rows = open_bed(str(bed_toml)), 0

    def count(row: object, picture: object) -> None:
        nonlocal rows
        rows += 1
        on_row(rows)

    try:
        return run_recipe(read_recipe(recipe), bed, out, on_row=count)
    finally:
        bed.close()


def started(recipe: Path, bed_toml: Path, out: Path) -> BaseProcess:
    """Start a process that runs a recipe."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    process = context.Process(target=_child, args=(dict(os.environ), recipe, bed_toml, out), daemon=True)
    process.start()
    return process


def _child(environment: Mapping[str, str], *given: Path) -> None:
    os.environ.update(environment)
    line.sleep = lambda seconds: None  # type: ignore[attr-defined]
    run(*given)
