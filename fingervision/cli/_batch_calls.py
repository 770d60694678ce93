"""`fingervision.batch.measure` and `fingervision.batch.diagnose`: the commands on many inputs, from Python."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

import click

from fingervision.batch.run import Batch
from fingervision.cli.batch import options_of, run_batch
from fingervision.domain.errors import UnknownNameError, UsageError
from fingervision.interface.argument_checks import OF_OPTIONS, path_of, speaks_python
from fingervision.interface.progress import Bar

Inputs: TypeAlias = "str | os.PathLike[str] | Iterable[str | os.PathLike[str]]"


@speaks_python
def measure(
    inputs: Inputs = (),
    *,
    out: "str | os.PathLike[str]",
    list_file: "str | os.PathLike[str] | None" = None,
    scheduler: str | None = None,
    jobs: int | None = None,
    progress: Bar | bool | None = None,
    **options: Any,
) -> Batch:
    """Measure many recordings, on all cores or on a Dask cluster, into a result folder for each.

    In a script, call it under `if __name__ == "__main__":`, because the worker processes import the script.

    Parameters
    ----------
    inputs : path or iterable of path
        Recordings, or patterns such as `recordings/**/*.mp4`.
    out : path
        Folder for all results; inputs that are done there are not processed again.
    list_file : path or None
        CSV table with a row for each recording and its options, in place of `inputs`.
    scheduler : str or None
        Address of a Dask cluster, tcp://HOST:PORT.
    jobs : int or None
        Number of processes on this computer; None is one per core.
    progress : callable, bool or None
        As in `fingervision.measure`.
    **options
        Options of `fingervision measure`, by their names: `px_per_mm=34`, `calibration="calibration.json"`.

    Returns
    -------
    Batch
        An outcome for each input; `out / "batch.csv"` holds their numbers.

    Raises
    ------
    UsageError
        An option is unknown or has an impossible value.
    InputFileError, OutputError, ProcessError
        Nothing matches, the results cannot be written, or all workers are gone.

    Examples
    --------
    >>> import fingervision as fv
    >>> fv.batch.measure("no_such/*.mp4", out="results", px_per_mm=34.0)
    Traceback (most recent call last):
        ...
    fingervision.domain.errors.InputFileError: No file matches no_such/*.mp4: check the path, and put patterns in ...
    """
    return _run("measure", inputs, out, list_file, None, scheduler, jobs, progress, options)


@speaks_python
def diagnose(
    inputs: Inputs = (),
    *,
    out: "str | os.PathLike[str]",
    list_file: "str | os.PathLike[str] | None" = None,
    results: "str | os.PathLike[str] | None" = None,
    scheduler: str | None = None,
    jobs: int | None = None,
    progress: Bar | bool | None = None,
    **options: Any,
) -> Batch:
    """Diagnose many measured tables, as `measure` measures many recordings.

    Parameters
    ----------
    inputs, out, list_file, scheduler, jobs, progress
        As in `measure`, with measured tables for recordings.
    results : path or None
        Folder of a batch of `measure`, whose gaps of the list's recordings are diagnosed.
    **options
        Options of `fingervision diagnose`, by their names: `model="comsol.csv"`, `with_effects=["backlash"]`.

    Returns
    -------
    Batch
        An outcome for each input; `out / "batch.csv"` holds their numbers.

    Raises
    ------
    UsageError
        An option is unknown or has an impossible value.
    InputFileError, OutputError, ProcessError
        Nothing matches, the results cannot be written, or all workers are gone.
    """
    return _run("diagnose", inputs, out, list_file, results, scheduler, jobs, progress, options)


def _run(
    name: str,
    inputs: Any,
    out: Any,
    list_file: Any,
    results: Any,
    scheduler: str | None,
    jobs: int | None,
    progress: Bar | bool | None,
    options: dict[str, Any],
) -> Batch:
    known = {}
    for option in options_of(name):
        word = next(flag for flag in option.opts if flag.startswith("--")).removeprefix("--")
        known[OF_OPTIONS.get(word, word.replace("-", "_"))] = option
    given = {}
    for key, value in options.items():
        if key not in known:
            raise UnknownNameError("option", key, known, f"an option of fingervision {name}")
        if value is not None:
            given[known[key]] = _stated(known[key], value)
    listed = (inputs,) if isinstance(inputs, str | os.PathLike) else inputs
    files = [None if each is None else path_of(what, each, "a file or folder")
             for what, each in (("list_file", list_file), ("results", results), ("out", out))]  # fmt: skip
    return run_batch(
        name, given, tuple(map(os.fspath, listed)), files[0], files[1], files[2] or Path(), scheduler, jobs, progress
    )[1]


def _stated(option: click.Option, value: Any) -> Any:
    """Convert a value as the command line does; several numbers such as a region become one word."""
    if option.is_flag:
        return bool(value)
    several = isinstance(value, list | tuple)
    words = [str(each) for each in value] if several else [str(value)]
    if several and not option.multiple:
        words = [",".join(words)]
    try:
        converted = [option.type.convert(word, option, None) for word in words]
    except click.UsageError as error:
        raise UsageError(f"{option.opts[0]} is not understood: {error.format_message()}") from None
    return tuple(converted) if option.multiple else converted[0]
