"""Options that several commands share: scale, what is measured, models, clock, test bed and output."""

from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any

import click

from fingervision.cli._command import (
    BED,
    CLOCK,
    FILE,
    FOLDER,
    MEASURED,
    MODEL,
    MODEL_FILE,
    NUMBER,
    OUTPUT,
    PAGE,
    SCALE,
    TABLES,
    FileName,
    Function,
    KindName,
    option,
    together,
)
from fingervision.domain.errors import ArgumentError, UsageError
from fingervision.domain.numbers import stated_number

MODEL_WORDS = "Simulation .csv, gripper.toml, model.toml, .fmu, or .py with simulate(time_s, input_mm)"
REFERENCES = ("bar", "slot")


def out_option(
    default: str | None = None, words: str = "Folder for the results.", kind: FileName = FOLDER, **more: Any
) -> Callable[[Function], Function]:
    """Make the option --out, the folder or file for the results."""
    return option(
        "-o", "--out", type=kind, default=default, show_default=default is not None, help=words, group=OUTPUT, **more
    )


def json_option(words: str) -> Callable[[Function], Function]:
    """Make the option --json, with which the result is printed for programs."""
    return option("--json", "as_json", is_flag=True, help=words, group=OUTPUT)


def figure_option(words: str, *former: str, **more: Any) -> Callable[[Function], Function]:
    """Make the option --figure, the file of a picture."""
    return option("--figure", type=FILE, former=former, help=words, group=OUTPUT, **more)


def seed_option(words: str, default: int | None = 1) -> Callable[[Function], Function]:
    """Make the option --seed."""
    return option("--seed", type=click.IntRange(0), default=default, show_default=default is not None, help=words)


def roi_option(words: str) -> Callable[[Function], Function]:
    """Make the option --roi, which `region_from` reads."""
    return option("--roi", metavar="X,Y,W,H", help=words, group=MEASURED)


def response_option(auto: str, group: str) -> Callable[[Function], Function]:
    """Make the option --response; `auto` says what that word stands for."""
    return option(
        "--response", default="auto", show_default=True, metavar="auto|linear|srgb|bt709|FILE", group=group,
        help=f"Camera response (light for each grey level); auto: {auto}.",
    )  # fmt: skip


def _take_settings(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Take the values of options that the user does not give from a settings file."""
    if path is None:
        return None
    from fingervision.storage.settings_toml import read_settings

    found = read_settings(path)
    camera = found.pop("camera", {})
    if any(each.name == "exposure_ms" for each in context.command.params):
        found |= camera
    known = {each.name for each in context.command.params}
    context.default_map = {name: value for name, value in found.items() if name in known}
    return path


_measuring_options = together(
    option("--calibration", type=FILE, group=SCALE, help="File calibration.json with the scale and its uncertainty."),
    option(
        "--px-per-mm", type=NUMBER, group=SCALE,
        help="Scale in pixels per mm; without --u-px-per-mm, only the random part of the uncertainty is given.",
    ),
    option(
        "--u-px-per-mm", type=NUMBER, group=SCALE,
        help="Standard uncertainty of --px-per-mm, in pixels per mm; u_gap_mm then includes it.",
    ),
    option(
        "--below-tip-mm", type=NUMBER, default=0.3, show_default=True, group=MEASURED,
        help="Distance (mm) below each finger's tip at which the gap is measured.",
    ),
    option(
        "--tips", type=click.Choice(["auto", "up", "down", "left", "right"]), default="auto", show_default=True,
        group=MEASURED, help="Direction in which the fingertips point in the picture.",
    ),
    roi_option("Region of interest: first column, first row, width, height in pixels."),
    option(
        "--settings", type=FILE, is_eager=True, expose_value=False, callback=_take_settings,
        help="Settings file, as saved by the browser page; options on the command line override it.",
    ),
)  # fmt: skip
how_to_read_pictures = together(
    response_option(
        "that of the calibration, else that which the shape of the edges shows, else the recording's own tag, else "
        "linear",
        MEASURED,
    ),
    option(
        "--bits", type=click.IntRange(8, 16), group=MEASURED,
        help="True bit depth of grey levels that are stored in 16 bits, if it is less than 16.",
    ),
)  # fmt: skip


def fingers_option(*more: str, words: str = "", **default: Any) -> Callable[[Function], Function]:
    """Make the option of the fingers' brightness, with further choices and words about them."""
    return option(
        "--fingers", type=click.Choice(["auto", "dark", "light", *more]), group=MEASURED, **default,
        help=f"Whether the fingers are darker or lighter than the background{words}.",
    )  # fmt: skip


def where_to_measure(command: Function) -> Function:
    """Add the options of scale, height, direction and region to a command that measures pictures."""

    @wraps(command)
    def with_one_scale(**options: Any) -> Any:
        context = click.get_current_context()
        from_file = click.core.ParameterSource.DEFAULT_MAP
        for given, other in (("px_per_mm", "calibration"), ("calibration", "px_per_mm")):
            sources = [context.get_parameter_source(name) for name in (given, other)]
            if options[given] is not None and sources[0] is not from_file and sources[1] is from_file:
                # A scale on the command line replaces the scale of the file, also one of the other kind.
                options[other] = None
        is_of_file = context.get_parameter_source("u_px_per_mm") is from_file
        if is_of_file and (options["px_per_mm"] is None or context.get_parameter_source("px_per_mm") is not from_file):
            options["u_px_per_mm"] = None  # it belongs to the file's scale
        return command(**options)

    return _measuring_options(with_one_scale)


rate_option = option(
    "--rate-hz", type=NUMBER, group=CLOCK, help="Images per second, if the images carry no times."
)  # fmt: skip
columns_option = option(
    "--columns", type=FILE, group=TABLES, metavar="columns.toml",
    help="Meaning of the columns, from `fingervision table`; default: the columns.toml beside each table.",
)  # fmt: skip


def drive_options(drive: str, offset: str) -> Callable[[Function], Function]:
    """Make the options --drive and --drive-offset-s with their help."""
    return together(
        option("--drive", type=FILE, group=CLOCK, help=drive),
        option("--drive-offset-s", type=NUMBER, group=CLOCK, help=offset),
    )


def _single(context: click.Context, parameter: click.Parameter, value: tuple[Path, ...]) -> Path:
    """Return the single model of an option; more than one is refused, so that no model is silently ignored."""
    if len(value) > 1:
        raise click.BadParameter(
            f"one model is diagnosed at a time, but {len(value)} were given: `fingervision compare` takes several.",
            context,
            parameter,
        )
    return value[0]


model_option = option(
    "--model", "model_path", required=True, multiple=True, callback=_single, type=MODEL_FILE, group=MODEL,
    help=f"{MODEL_WORDS}.",
)  # fmt: skip
models_option = option(
    "--model", "model_paths", required=True, multiple=True, type=MODEL_FILE, group=MODEL,
    help=f"{MODEL_WORDS}; several are compared in one figure.",
)  # fmt: skip
title_option = option("--title", default="", metavar="WORDS", group=OUTPUT, help="Title of page and plots.")
names_option = option(
    "--name", "names", multiple=True, metavar="MODEL=WORDS", group=OUTPUT,
    help="Name of a model in the legends of the plots; repeatable.",
)  # fmt: skip


def names_of(models: Sequence[Path], names: Sequence[str]) -> dict[Path, str]:
    """Interpret `--name`; a model is named as after `--model`, or by its file's name alone."""
    found: dict[Path, str] = {}
    for words in names:
        by_model = {model: words.removeprefix(f"{known}=") for model in models for known in (str(model), model.name)
                    if words.startswith(f"{known}=")}  # fmt: skip
        if len(by_model) != 1 or not all(by_model.values()):
            raise UsageError(
                f"--name must be MODEL=WORDS with one of the models ({', '.join(map(str, models))}), but is {words}."
            )
        found |= by_model
    return found


kind_option = option(
    "--kind", type=KindName(), default="lumped", show_default=True, group=MODEL,
    help="Kind of model by which a gripper.toml is computed.",
)  # fmt: skip


def complete_effect(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Complete the name of an effect for the shell."""
    from fingervision.effects import catalogue

    return [name for name in catalogue() if name.startswith(incomplete)]


def effects_option(command: Function) -> Function:
    """Add `--effects`: Python files whose effects are added to the catalogue while the command runs."""

    @wraps(command)
    def with_effects(*arguments: Any, effects_files: tuple[Path, ...], **options: Any) -> Any:
        if not effects_files:
            return command(*arguments, **options)
        from fingervision.effects import added_effects

        with added_effects(effects_files):
            return command(*arguments, **options)

    return option(
        "--effects", "effects_files", multiple=True, metavar="FILE.py", type=FILE, group=MODEL,
        help="Add the effects of this Python file to the catalogue; repeatable.",
    )(with_effects)  # fmt: skip


bed_option = option(
    "--bed", "bed_name", default="simulated", show_default=True, metavar="simulated|CONFIG.toml", group=BED,
    help="The test bed: the word simulated, or its configuration file (bed.toml, see File formats in the manual).",
)  # fmt: skip
hide_option = option(
    "--hide", multiple=True, metavar="EFFECT[:PARAMETER=VALUE,...]|SEALED.toml", shell_complete=complete_effect,
    group=BED,
    help="Hide an effect of the catalogue in the simulated parts: measurement and diagnosis do not know it; "
    "repeatable.",
)  # fmt: skip
port_option = option(
    "--port", type=click.IntRange(0, 65535), default=8025, show_default=True, group=PAGE,
    help="Network port of the browser page; 0: any free port.",
)  # fmt: skip


def region_from(roi: str | None) -> tuple[int, int, int, int] | None:
    """Read a region of interest in the form X,Y,W,H (pixels).

    Raises
    ------
    UsageError
        The region is not four whole numbers.
    """
    if roi is None:
        return None
    try:
        x, y, width, height = (int(part) for part in roi.split(","))
    except ValueError:
        raise UsageError(f"--roi must be four whole numbers X,Y,W,H in pixels, but is {roi!r}.") from None
    return x, y, width, height


def named_references(
    items: Sequence[str], kind: str, form: str = "SIZE_MM with a positive size", example: str = "ref5.png=5.000"
) -> list[tuple[Path, float, str]]:
    """Read picture, size and kind of every reference object in the form IMAGE=SIZE_MM or slot:IMAGE=SIZE_MM.

    Raises
    ------
    UsageError
        An item has another form than `form`.
    """
    found = []
    for item in items:
        name, _, size = item.rpartition("=")
        prefix, colon, rest = name.partition(":")
        which, name = (prefix, rest) if colon and prefix in REFERENCES else (kind, name)
        try:
            size_mm = stated_number(size, f"The size in {item}")
        except ArgumentError as error:
            if "," in size:
                raise UsageError(str(error)) from None
            size_mm = 0.0
        if not name or not 0.0 < size_mm < float("inf"):
            what = "reference" if "SIZE" in form else "picture"
            raise UsageError(f"A {what} must be IMAGE={form}, but is {item!r}: write {example}.")
        found.append((Path(name), size_mm, which))
    return found


def results_folder(out: Path, source: Path) -> Path:
    """Return the folder of --out or the default folder; if it has results of another input, choose a new name.

    Parameters
    ----------
    out : Path
        Value of --out.
    source : Path
        The input file or folder of the command.

    Raises
    ------
    UsageError
        The folder that the user names holds the results of another input.
    """
    from fingervision.storage.out_folder import own_folder

    context = click.get_current_context()
    named = context.get_parameter_source("out") is not click.core.ParameterSource.DEFAULT
    found = own_folder(out, source, named=named)
    if found != out:
        click.echo(f"{out} holds the results of another input: the new results are written to {found}.", err=True)
    return found


def running_command() -> str:
    """Return the command line of this process, for the provenance of a result."""
    import shlex
    import sys

    return shlex.join(["fingervision", *sys.argv[1:]])
