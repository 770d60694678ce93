"""`fingervision model --object-mm`: gripping force on a part between the fingers, as a table and a plot."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, isfinite
from pathlib import Path
from typing import Any

import click
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingervision.cli._model_figures import save_figure
from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.grip import Part, first_grip_mm, gripped
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import GrippedPair, PairGrip
from fingervision.storage.row_file import write_table

_COLUMNS = ("kind", "input_mm", "gap_mm", "held_width_mm", "grip_n", "force_n", "stress_mpa")
_ROWS = 61
_BEYOND_MM = 1e-9


def part_asked(width_mm: float | None, stiffness_n_mm: float | None, rest_gap_mm: float) -> Part | None:
    """Read and check the options that describe the gripped part.

    Raises
    ------
    UsageError
        The width or the stiffness is not positive, or the part does not fit between the fingers.
    """
    if width_mm is None:
        if stiffness_n_mm is not None:
            raise UsageError("--object-n-mm, the stiffness of the part, needs its width too: add --object-mm.")
        return None
    if not (isfinite(width_mm) and width_mm > 0.0):
        raise UsageError(f"--object-mm must be the positive width of a part, but is {width_mm:g}.")
    if stiffness_n_mm is not None and not (isfinite(stiffness_n_mm) and stiffness_n_mm > 0.0):
        raise UsageError(f"--object-n-mm must be a positive stiffness in N/mm, but is {stiffness_n_mm:g}.")
    if width_mm > 10.0 * abs(rest_gap_mm):
        raise UsageError(
            f"--object-mm must be the width of a part that fits between the fingers, but is {width_mm:g} mm at a rest "
            f"gap of {rest_gap_mm:g} mm; is it in micrometres?"
        )
    return Part(width_mm) if stiffness_n_mm is None else Part(width_mm, stiffness_n_mm)


def write_grip(
    gripper: Gripper, models: Mapping[str, Any], part: Part, inputs: NDArray[np.float64] | None, name: str, out: Path,
    *, errors: Mapping[str, float], as_json: bool,
) -> None:  # fmt: skip
    """Write grip.csv and grip.png for every kind of model (small displacements), and print how the part is held.

    `errors` holds the relative error of the gripping force for each kind of model.
    """
    rows: dict[str, NDArray[np.float64]] = {}
    said = []
    for kind, model in models.items():
        if not isinstance(model, DrawnGripper):
            click.echo(
                f"{kind} cannot compute a part between the fingers: grip.csv has no rows of this kind of model.",
                err=True,
            )
            continue
        touch = first_grip_mm(model, part)
        limit = _closing_limit_mm(gripper, model, touch)
        at = np.linspace(limit, 0.3 * abs(limit) + (touch or 0.0), _ROWS) if inputs is None else np.sort(inputs)
        if touch is not None and at.min() < touch < at.max():
            # The curve has a kink at this input.
            at = np.union1d(at, [touch])
        rows[kind] = np.array([_row(model, float(value), part) for value in at])
        if touch is not None:
            said.append(_words(gripper, kind, model, part, touch, errors[kind]))
    write_table(out / "grip.csv", _COLUMNS, _lines(rows), digits=7)
    _draw(rows, part, name, out / "grip.png")
    if not as_json:
        for words in said:
            click.echo(words)


@dataclass(frozen=True, slots=True)
class PartOfPair:
    """A part that is gripped between the two probes of a pair of a mechanism."""

    part: Part
    pair: str


def part_of_pair(
    width_mm: float | None, stiffness_n_mm: float | None, mechanism: Mechanism, kind: str
) -> PartOfPair | None:
    """Read and check the gripped part, and find the pair of probes that grips it: the pair named gap, or the only pair.

    Raises
    ------
    UsageError
        The width or the stiffness of the part is not positive, the drawing has no such pair, or the kind of model does
        not compute it.
    """
    if width_mm is None and stiffness_n_mm is None:
        return None
    if kind not in (MechanismPlate.kind, "all"):
        raise UsageError(
            f"A part between probes (--object-mm) is computed by finite elements only, but --kind is {kind}: choose "
            "--kind finite_element."
        )
    pairs = mechanism.pairs
    name = "gap" if "gap" in pairs else next(iter(pairs), "")
    if not pairs or (name != "gap" and len(pairs) > 1):
        has = f"{', '.join(pairs)} and none of that name" if pairs else "no [[pair]]"
        raise UsageError(
            f"--object-mm needs a pair of probes that grips the part (named gap if there are several), but "
            f"{mechanism.name} has {has}."
        )
    apart = [a - b for a, b in zip(*(mechanism.probes[end] for end in pairs[name]), strict=True)]
    part = part_asked(width_mm, stiffness_n_mm, hypot(*apart))
    return None if part is None else PartOfPair(part, name)


def write_pair_grip(
    models: Mapping[str, Any], asked: PartOfPair, inputs: NDArray[np.float64] | None, out: Path, *, as_json: bool
) -> None:
    """Write grip.csv and grip.png for the finite elements of a mechanism, and print how the part is held."""
    plate = models.get("finite_element")
    if not isinstance(plate, MechanismPlate):  # it was refused with its reason
        return
    held, part = GrippedPair(plate, asked.pair), asked.part
    touch = held.touch_input_mm(part)
    reach = max(abs(touch), 0.1 * held.rest_mm / abs(held.per_input))
    closing = -1.0 if held.per_input > 0.0 else 1.0
    at = np.linspace(touch - 0.3 * closing * reach, touch + 0.5 * closing * reach, _ROWS) if inputs is None else inputs
    if at.min() < touch < at.max():
        at = np.union1d(at, [touch])
    states = [held.at(float(value), part) for value in np.sort(at)]
    rows = {plate.kind: np.array([_cells(state, part) for state in states])}
    write_table(out / "grip.csv", _COLUMNS, _lines(rows), digits=7)
    _draw(rows, part, f"{plate.mechanism.name}, {asked.pair}", out / "grip.png")
    beyond = held.at(touch + closing, part)
    words = (
        f"{plate.kind}: a part of {part.width_mm:g} mm ({_stiff(part)}) between the probes of {asked.pair} is touched "
        f"at {touch:.4g} mm of input, and gripped by {beyond.grip_n:.4g} N per mm beyond. Model error of the grip: "
        f"{100.0 * plate.force_error:.2g} %, without the dents at the probes."
    )
    limit = plate.mechanism.material.yield_mpa
    hot = max(states, key=lambda state: state.stress_mpa)
    if not as_json:
        click.echo(words)
    if hot.stress_mpa > limit:
        click.echo(
            f"Warning: with the part held, at an input of {hot.input_mm:.3g} mm, the stress in the flexures must stay "
            f"below the yield of {limit:g} MPa, but is {hot.stress_mpa:.3g} MPa.",
            err=True,
        )


def _cells(state: PairGrip, part: Part) -> tuple[float, ...]:
    held = part.squeezed_mm(state.grip_n) if state.grip_n > _BEYOND_MM else np.nan
    return state.input_mm, state.distance_mm, held, state.grip_n, state.force_n, state.stress_mpa


def _lines(rows: Mapping[str, NDArray[np.float64]]) -> list[list[object]]:
    return [[kind, *row] for kind, table in rows.items() for row in table.tolist()]


def _stiff(part: Part) -> str:
    return f"{part.stiffness_n_mm:g} N/mm" if isfinite(part.stiffness_n_mm) else "rigid"


def _closing_limit_mm(gripper: Gripper, model: DrawnGripper, touch_mm: float | None) -> float:
    """Input (mm) at which closing ends: past the touch of the part by half the stroke that closes the empty fingers."""
    touch = model.first_touch_mm
    reach = abs(touch) if touch is not None else 0.01 * gripper.body.height_mm
    return (touch_mm or 0.0) - 0.5 * reach


def _row(model: DrawnGripper, input_mm: float, part: Part) -> tuple[float, ...]:
    loaded = gripped(model, input_mm, part)
    held = part.squeezed_mm(loaded.grip_n) if loaded.grip_n > _BEYOND_MM else np.nan
    return input_mm, loaded.gap_mm, held, loaded.grip_n, loaded.force_n, loaded.stress_mpa


def _words(gripper: Gripper, kind: str, model: DrawnGripper, part: Part, touch_mm: float, error: float) -> str:
    """Sentence on the inputs (mm) at which the part is touched and yields, and on the slope of the gripping force."""
    limit = gripper.material.yield_mpa
    step = 0.2 * abs(model.first_touch_mm or touch_mm)
    near = [gripped(model, touch_mm - by, part) for by in (0.0, step)]
    per_input = (near[1].grip_n - near[0].grip_n) / step
    at, most = touch_mm, near[1]
    while most.stress_mpa < limit and abs(at - touch_mm) < 50.0 * step:
        at -= step
        most = gripped(model, at, part)
    before = gripped(model, at + step, part)
    share = (limit - before.stress_mpa) / (most.stress_mpa - before.stress_mpa)
    grip = before.grip_n + share * (most.grip_n - before.grip_n)
    where = before.input_mm + share * (most.input_mm - before.input_mm)
    pulled = abs(before.force_n + share * (most.force_n - before.force_n))
    return (
        f"{kind}: a part of {part.width_mm:g} mm ({_stiff(part)}) is touched at {touch_mm:.4g} mm of input; each "
        f"finger grips it by {per_input:.4g} N per mm beyond, at most {grip:.3g} N at {where:.4g} mm, where the hinges "
        f"yield (the drive then pulls {pulled:.3g} N). Model error of the grip: {100.0 * error:.2g} %."
    )


def _draw(rows: Mapping[str, NDArray[np.float64]], part: Part, name: str, path: Path) -> None:
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for place, (kind, table) in enumerate(rows.items()):
        style = {"color": f"C{place}", "linestyle": ("-", "--", "-.")[place % 3]}
        upper.plot(table[:, 0], table[:, 3], label=kind, **style)
        lower.plot(table[:, 0], table[:, 4], **style)
    upper.set_title(
        f"{name}: grip on a part of {part.width_mm:g} mm ({_stiff(part)}), small displacements", fontsize="medium"
    )
    upper.set_ylabel("grip of each finger / N")
    lower.set_ylabel("force at the drive / N")
    lower.set_xlabel("input / mm")
    upper.legend()
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
    save_figure(figure, path)
