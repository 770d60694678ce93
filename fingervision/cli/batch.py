"""`fingervision batch`: measure or diagnose many inputs, on all cores of this computer or on a Dask cluster."""

from collections.abc import Callable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from copy import copy
from io import StringIO
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import click

from fingervision.batch.task import NO_ROOM, Ended
from fingervision.cli import cli
from fingervision.cli._command import FILE, FOLDER, OUTPUT, Command, Group, Option, complain
from fingervision.domain.errors import ExitCode, FingervisionError, InputFileError, StateError, UsageError

if TYPE_CHECKING:
    from fingervision.batch.run import Batch, Plan, Row
    from fingervision.batch.task import Perform
    from fingervision.interface.progress import Bar

EXAMPLES = """
\b
Examples:
  fingervision batch measure 'recordings/**/*.mp4' --calibration calibration.json --out results
  fingervision batch measure recordings/first/*.mp4 recordings/second/*.mp4 --px-per-mm 34 --jobs 2 --out others
  fingervision batch measure '/lab/**/*.mkv' --calibration /lab/c.json --scheduler tcp://head:8786 --out /lab/results
  fingervision batch diagnose 'runs/*/samples.csv' --model comsol.csv --out diagnoses
  fingervision batch measure --list runs.csv --out day
  fingervision batch diagnose --list runs.csv --results day --out explained

\b
A list is a CSV table with a row for each input: recording (or measured, for diagnose) and any options as columns
(drive,calibration,model,px_per_mm,...). Files are relative to the list; empty cells state nothing; options given here
hold for all rows that do not state them. With --results, diagnose takes the gaps that batch measure wrote.

\b
Put patterns in quotes; ** stands for any folders. Give the same command again to continue after a crash or Ctrl-C: it
processes only inputs that are not done, have changed, or failed. Each worker uses one core. All machines of a cluster
must see the files under the same path.

\b
Files written to --out:
  <input's name>/  the files of the command, and record.json: input, options and version of each result
  batch.csv        one row per input: result, exit code, message, numbers
  batch.png        all results in one plot
  index.html       a small picture of each result, on a single self-contained page

\b
Exit codes: 0 all done; 1 no input could be processed, or the batch was stopped; 2 wrong usage; 3 done, but some inputs
were damaged or could not be processed: each is listed with its message.
"""
# The streams belong to the whole process; a Dask worker may have several threads.
_ONE_AT_A_TIME = Lock()
OWN = ("inputs", "list_file", "results", "out", "scheduler", "jobs", "as_json")
BAD_SHOWN = 10
BATCH = "Batch"
"""Group of the help."""
COMMANDS = ("measure", "diagnose")


@click.group("batch", cls=Group, epilog=EXAMPLES)
def command() -> None:
    """Run one command on many inputs, with a result folder for each input and an overview of all results."""


def options_of(name: str) -> list[click.Option]:
    """Options of the single command that a batch takes too; what that command requires may stand in a list."""
    single = cli.get_command(click.Context(cli), name)
    assert single is not None  # noqa: S101 - named below
    options = [
        copy(option)
        for option in single.params
        if isinstance(option, click.Option) and option.name not in ("out", "as_json")
    ]
    for option in options:
        if option.required:
            option.required, option.callback = False, _if_stated(option.callback)
    return options


def _if_stated(callback: Callable[..., Any] | None) -> Callable[..., Any]:
    """Let an option's own check see only values that the command line states."""

    def checked(context: click.Context, option: click.Parameter, value: Any) -> Any:
        return callback(context, option, value) if callback is not None and value else value

    return checked


def _batch_of(name: str) -> click.Command:
    """Make a batch command that has the options of the single command and those of a batch."""
    options = options_of(name)

    def callback(**chosen: Any) -> None:
        context = click.get_current_context()
        given = {
            option: chosen[str(option.name)]
            for option in options
            if context.get_parameter_source(str(option.name)) is not click.core.ParameterSource.DEFAULT
        }
        chosen = {"results": None, **{key: chosen[key] for key in OWN if key in chosen}}
        as_json = chosen.pop("as_json")
        plan, batch = run_batch(name, given, **chosen, progress=True)
        _report(plan, batch, as_json)
        raise SystemExit(int(batch.exit_code))

    def of_batch(*declared: str, group: str = BATCH, **settings: Any) -> Option:
        return Option(declared, group=group, **settings)

    results = of_batch(
        "--results", type=FOLDER, help="Folder of `batch measure`, whose gaps of the list's recordings are diagnosed."
    )
    return Command(
        name,
        callback=callback,
        params=[
            click.Argument(["inputs"], nargs=-1, metavar="[INPUT...]"),
            of_batch("--list", "list_file", type=FILE, help="CSV table with a row for each input, in place of INPUT."),
            *([results] if name == "diagnose" else ()),
            of_batch(
                "--scheduler",
                metavar="tcp://HOST:PORT",
                help="Address of a Dask cluster whose workers process the inputs.",
            ),
            of_batch(
                "--jobs",
                type=click.IntRange(min=1),
                help="Number of processes on this computer; default: one per core.",
            ),
            *options,
            of_batch("-o", "--out", type=FOLDER, required=True, help="Folder for all results.", group=OUTPUT),
            of_batch("--json", "as_json", is_flag=True, help="Print the result of every input as JSON.", group=OUTPUT),
        ],
        help=f"Run `fingervision {name}` on every INPUT. Inputs are paths, or patterns in quotes.",
        epilog=EXAMPLES,
    )


def perform(name: str, arguments: tuple[str, ...]) -> Ended:
    """Run a command in the same way as the command line does.

    Parameters
    ----------
    name : str
        The command's name.
    arguments : tuple of str
        Arguments and options as on the command line.
    """
    said = StringIO()
    with _ONE_AT_A_TIME, redirect_stdout(StringIO()), redirect_stderr(said):
        try:
            cli.main([name, *arguments], prog_name="fingervision", standalone_mode=False)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else ExitCode.DONE
            return Ended(int(code), said.getvalue().removeprefix("fingervision: ").strip(), finished=True)
        except click.ClickException as error:
            return Ended(error.exit_code, error.format_message(), finished=False)
        except click.Abort:
            return Ended(ExitCode.COULD_NOT, "The command was stopped before its end: call it again.", finished=False)
        except FingervisionError as error:
            return Ended(int(error.exit_code), str(error), finished=False, disk_full=_is_for_want_of_room(error))
        except Exception as error:  # a defect of this program in one recording must not stop the others
            words = f"A fault in fingervision ended the command ({type(error).__name__}: {error}): please report it."
            return Ended(ExitCode.COULD_NOT, words, finished=False, disk_full=_is_for_want_of_room(error))
    return Ended(ExitCode.DONE, "", finished=True)


def _is_for_want_of_room(error: BaseException | None) -> bool:
    while error is not None:
        if isinstance(error, OSError) and error.errno in NO_ROOM:
            return True
        error = error.__cause__ or error.__context__
    return False


def run_batch(
    name: str,
    given: Mapping[click.Option, Any],
    inputs: tuple[str, ...],
    list_file: Path | None,
    results: Path | None,
    out: Path,
    scheduler: str | None,
    jobs: int | None,
    progress: "Bar | bool | None",
) -> tuple["Plan", "Batch"]:
    """Run a command on many inputs; the command line and `fingervision.batch` call this function.

    Parameters
    ----------
    name : str
        `measure` or `diagnose`.
    given : mapping of click.Option to object
        Options of the command (`options_of`) that are stated, with their values.
    inputs, list_file, results, out, scheduler, jobs
        The options of `fingervision batch`.
    progress : callable, bool or None
        As in `fingervision.measure`.

    Raises
    ------
    UsageError
        The request makes no sense.
    FingervisionError
        Nothing matches, or the results cannot be written.
    """
    from contextlib import ExitStack
    from functools import partial

    from fingervision.batch import cluster
    from fingervision.batch.local_processes import LocalCrew, cores
    from fingervision.batch.run import Crew, Job, planned, run
    from fingervision.interface.progress import shown

    if scheduler is not None and jobs is not None:
        raise UsageError(
            "--jobs is for this computer and --scheduler for a cluster, but both are given: leave one out."
        )
    if bool(inputs) == (list_file is not None) or (results is not None and list_file is None):
        raise UsageError(
            "The inputs must be named one way, as INPUT... or by --list FILE (and --results DIR only with a list), but "
            f"{'both are' if inputs and list_file else 'neither is' if not inputs else '--results is'} given: correct "
            "the command."
        )
    is_far = scheduler is not None
    rows = () if list_file is None else _rows_of(list_file, name, given, results, is_far=is_far)
    arguments = tuple(_arguments(given, absolute=is_far))
    plan = planned(Job(name, inputs, arguments, "" if rows else _options_key(name, given), out, rows))
    with ExitStack() as stack:
        crew: Crew
        if scheduler is None or not plan.to_do:
            local = stack.enter_context(LocalCrew(perform, min(jobs or len(cores()), len(plan.to_do))))
            crew = local.outcomes_of
            if plan.to_do and not rows:
                _check_options(name, arguments, local.answer)
        else:
            if not rows:
                _check_options(name, arguments, perform)
            crew = partial(cluster.outcomes_of, stack.enter_context(cluster.connected(scheduler)), perform=perform)
        show = stack.enter_context(shown(progress, f"Batch {name}", "inputs"))
        return plan, run(plan, crew, show)


def _rows_of(
    path: Path,
    name: str,
    given: Mapping[click.Option, Any],
    results: Path | None,
    *,
    is_far: bool,
) -> tuple["Row", ...]:
    """Read a list; options of the command hold for every row that does not state them."""
    from fingervision.batch.run import Row
    from fingervision.cli._batch_list import listed_runs

    others = [option for other in COMMANDS if other != name for option in options_of(other)]
    rows = []
    for each in listed_runs(path, name, options_of(name), others, results):
        stated = {**given, **each.options}
        rows.append(
            Row(each.input, tuple(_arguments(stated, absolute=is_far)), _options_key(name, stated), each.missing)
        )
    return tuple(rows)


def _arguments(given: Mapping[click.Option, Any], *, absolute: bool) -> list[str]:
    """Write options in the form of the command line; file names become absolute if other computers do the work."""
    words: list[str] = []
    for option, value in given.items():
        flag = option.opts[0]
        if option.is_flag:
            words += [flag] if value else []
            continue
        for one in value if isinstance(value, tuple) else (value,):
            words += [flag, str(Path(one).absolute() if absolute and isinstance(one, Path) else one)]
    return words


def _options_key(name: str, given: Mapping[click.Option, Any]) -> str:
    """Hash of everything besides the input that determines the results: options, content of named files, version."""
    import hashlib
    import json

    from fingervision import __version__

    held: dict[str, Any] = {}
    for option, value in given.items():
        several = value if isinstance(value, tuple) else (value,)
        if several and value != option.default and value is not None:
            held[str(option.name)] = sorted(_content(one) if isinstance(one, Path) else str(one) for one in several)
    return hashlib.sha256(json.dumps([name, __version__, held], sort_keys=True).encode()).hexdigest()


def _content(path: Path, inside: tuple[Path, ...] = ()) -> str:
    """Hash of a file, and of the files to which a corrected model refers."""
    import hashlib

    from fingervision.batch.work import content_hash
    from fingervision.storage.plain_file import plain, toml_of, why

    try:
        found = content_hash(plain(path))
        base = toml_of(path).get("base") if path.suffix.lower() == ".toml" else None
    except FileNotFoundError:
        raise InputFileError(f"There is no file {path}: check the options.") from None
    except (OSError, ValueError) as error:
        raise InputFileError(f"{path} could not be read ({why(error)}): check the options.") from error
    place = path.resolve()
    if not (isinstance(base, str) and base.isprintable()) or (path.parent / base).resolve() in (*inside, place):
        return found  # a model that is based on itself is refused when it is read
    return hashlib.sha256(f"{found}\n{_content(path.parent / str(base), (*inside, place))}".encode()).hexdigest()


def _check_options(name: str, arguments: tuple[str, ...], ask: "Perform") -> None:
    """Refuse invalid options once, before any input is processed.

    The command is called with a nonexistent input; if the options are valid, the only error is that about this input.
    """
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as nowhere:
        try:
            ended = ask(name, (*arguments, "--out", str(Path(nowhere) / "out"), "--", str(Path(nowhere) / "nothing")))
        except KeyboardInterrupt:
            raise StateError(
                "Stopped by the user before the first input was measured: repeat the command to start."
            ) from None
    if nowhere not in ended.words:
        kind = UsageError if ended.exit_code == ExitCode.WRONG_USAGE else FingervisionError
        raise kind(ended.words)


def _report(plan: "Plan", batch: "Batch", as_json: bool) -> None:
    """Print the results of the batch on standard output, and errors on standard error."""
    import json

    if as_json:
        document = {
            "schema": 1,
            "command": plan.job.command,
            "inputs": len(batch.outcomes),
            "fresh": batch.fresh,
            "stopped": batch.stopped or None,
            "outcomes": [
                {
                    "input": one.input,
                    "result": None if one.folder is None else str(one.folder),
                    "exit_code": one.exit_code,
                    "words": one.words,
                    **(one.digest.cells if one.digest is not None else {}),
                }
                for one in batch.outcomes
            ],
        }
        click.echo(json.dumps(document, indent=2, allow_nan=False))
    else:
        there = sum(one.folder is not None for one in batch.outcomes)
        what = "nothing to do" if not batch.fresh else f"{batch.fresh} processed by this call"
        click.echo(f"{there} of {len(batch.outcomes)} inputs have a result ({what}).")
        click.echo(f"Written: {batch.out / 'batch.csv'}, {batch.out / 'batch.png'}, {batch.out / 'index.html'}")
    for one in batch.bad[:BAD_SHOWN] if not batch.stopped else ():
        subject = "" if one.words.startswith(one.input) else f"{one.input}: "
        complain(f"{subject}{one.words}")
    if len(batch.bad) > BAD_SHOWN and not batch.stopped:
        left = len(batch.bad) - BAD_SHOWN
        complain(f"{left} more inputs without a result are listed in {batch.out / 'batch.csv'}.")
    if batch.stopped:
        complain(batch.stopped)


for _name in COMMANDS:
    command.add_command(_batch_of(_name))
