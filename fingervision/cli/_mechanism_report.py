"""Printed results of a mechanism whose drawing lists its bodies, and warnings about the limits of the results."""

import json
from collections.abc import Mapping, Sequence
from math import copysign, isfinite

import click

from fingervision.models.elastic_mechanism import MechanismState
from fingervision.models.gripper_figures import Endurance, endurance, unit_of
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import MechanismModel
from fingervision.models.strips import necks_of

_MOST_NECKS = 3
_APART = 0.1
"""Relative difference of two kinds of model, beyond their stated errors, from which a message is printed (a
requirement)."""


def say_drawing(mechanism: Mechanism) -> None:
    """Print which parts are treated as flexures although the drawing does not name them, and what its drives do."""
    for strip in mechanism.strips:
        x, y = strip.at_mm
        click.echo(
            f"{strip.name} at ({x:.4g}, {y:.4g}) mm, {strip.thickness_mm:.4g} mm thick and "
            f"{2.0 * strip.half_length_mm:.4g} mm long, is treated as a flexure: it is much thinner than what it joins."
        )
    for drive in mechanism.drives:
        click.echo(drive.words)


def print_figures(name: str, table: dict[str, dict[str, float]], *, as_json: bool) -> None:
    """Print the table of results: one row per quantity, one column per kind of model."""
    if as_json:
        click.echo(json.dumps(table, indent=2))
        return
    click.echo(f"{name:<44}" + "".join(f"{kind:>18}" for kind in table))
    labels = list(dict.fromkeys(label for figures in table.values() for label in figures))
    for label in labels:
        cells = (f"{figures[label]:.6g}" if label in figures else "-" for figures in table.values())
        shown = label if label.endswith("]") else f"{label} [{unit_of(label)}]"
        click.echo(f"{shown:<44}" + "".join(f"{cell:>18}" for cell in cells))


def warn(
    mechanism: Mechanism, model: MechanismModel, states: list[MechanismState], table: dict[str, dict[str, float]], *,
    contact: bool,
) -> None:  # fmt: skip
    """Warn of yielding, of faces that penetrate each other, and of differences between the kinds of model."""
    if (corner := getattr(model, "unstated_stress_at_mm", None)) is not None:
        click.echo(
            f"Warning: the stress is not stated, because the outline has a re-entrant corner without a radius at "
            f"({corner[0]:.4g}, {corner[1]:.4g}) mm, where it has no limit: round the corner, or draw the thin strip "
            "there as a [[flexure]].",
            err=True,
        )
    for (x, y), thickness in necks_of(mechanism.region, mechanism.flexures)[:_MOST_NECKS]:
        click.echo(
            f"Warning: the drawing is only {thickness:.3g} mm thick at ({x:.4g}, {y:.4g}) mm, where it names no "
            "flexure: move the shapes apart there, or draw the neck as a [[flexure]], as its stress is not judged.",
            err=True,
        )
    worst = max(states, key=lambda state: state.stress_mpa)
    if worst.stress_mpa > mechanism.material.yield_mpa:
        at_yield_mm = next(iter(table.values()))["input_at_yield_mm"]
        click.echo(
            f"Warning: at an input of {worst.input_mm:.3g} mm the stress in the flexures must stay below the yield "
            f"stress of {mechanism.material.yield_mpa:g} MPa, but is {worst.stress_mpa:.3g} MPa; keep the input within "
            f"{at_yield_mm:.3g} mm.",
            err=True,
        )
    ends = [state.input_mm for state in (states[0], states[-1])]
    for name, at_mm in model.touch_input_mm().items():
        if not contact and min(ends) < at_mm < max(ends):
            click.echo(
                f"Warning: the faces of contact {name} touch at an input of {at_mm:.4g} mm; beyond this input, the "
                f"faces pass through each other, because contact is not computed: add --contact.",
                err=True,
            )
    if len(table) > 1:
        for sentence in disagreements_of(table):
            click.echo(f"Warning: {sentence}", err=True)


def disagreements_of(table: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Sentences on quantities in which the second kind of model differs from the first by more than the model errors.

    Differences of motions of probes and pairs are taken relative to the largest motion, because the relative error of a
    very small motion has no meaning.
    """
    (first, ours), (second, theirs) = list(table.items())[:2]
    stated = sum(figures["model_error_force_percent"] for figures in (ours, theirs)) / 100.0
    motions = [label for label in ours if label.endswith("per input [mm/mm]") and label in theirs]
    largest = max((abs(ours[label]) for label in motions), default=0.0)
    found = []
    for label in ("input_stiffness_n_mm", "mode_1_drive_free_hz", "mode_1_drive_held_hz", *motions):
        if label not in ours or label not in theirs:
            continue
        scale = largest if label in motions else abs(ours[label])
        apart = (theirs[label] - ours[label]) / scale if scale else 0.0
        if abs(apart) > _APART + stated:
            of = " of the largest motion" if label in motions else ""
            found.append(
                f"In {label}, {second} differs from {first} by {100.0 * apart:.3g} %{of}, but their model errors "
                f"together explain only {100.0 * stated:.2g} %; trust {first}."
            )
    return found


def add_endurance(mechanism: Mechanism, states: Sequence[MechanismState], figures: dict[str, float]) -> None:
    """Add the number of load cycles to failure over the range of inputs, if the material has an S-N line.

    The stress is assumed to change its sign with the input.
    """
    life = _life(mechanism, states)
    if life is not None and life.cycles is not None:
        figures["endurance_cycles"] = life.cycles


def _life(mechanism: Mechanism, states: Sequence[MechanismState]) -> Endurance | None:
    if not isfinite(states[0].stress_mpa):
        return None
    ends = sorted(copysign(state.stress_mpa, state.input_mm) for state in (states[0], states[-1]))
    return endurance(mechanism.material, ends[0], ends[1])


def say_endurance(kind: str, mechanism: Mechanism, states: Sequence[MechanismState]) -> None:
    """Print the number of load cycles that the flexures endure over the range of inputs."""
    life = _life(mechanism, states)
    if life is not None:
        click.echo(
            f"Endurance between {states[0].input_mm:.3g} and {states[-1].input_mm:.3g} mm ({kind}, the material's S-N "
            f"line, no scatter): {life.words}; the stress in the flexures changes by "
            f"+-{life.amplitude_mpa:.3g} MPa about {life.mean_mpa:.3g} MPa."
        )
