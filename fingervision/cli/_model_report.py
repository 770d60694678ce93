"""Remarks of the `model` command: how long the flexures last, what yields, what touches, and what a model omits."""

from collections.abc import Mapping, Sequence
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper, Material
from fingervision.models.answer_figures import LoadedState, ModelFigures, Physics
from fingervision.models.elastic_mechanism import MechanismState
from fingervision.models.gripper_figures import input_at_yield_mm, life_over
from fingervision.models.kinds import by_trust, small_displacements_alone
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import MechanismModel
from fingervision.models.strips import necks_of


def say_what_limits(
    gripper: Gripper,
    models: Mapping[str, Any],
    figures: Mapping[str, ModelFigures],
    inputs: NDArray[np.float64],
    physics: Physics,
    *,
    as_json: bool,
) -> None:
    """Warn of yielding, of fingers that penetrate each other, and of physical effects that a model omits."""
    for kind in by_trust(models):
        if hasattr(models[kind], "loaded"):
            _warn_of_stress(gripper, models[kind], inputs)
            if not as_json:
                ends = models[kind].loaded([float(inputs.min()), float(inputs.max())])
                say_endurance(kind, gripper.material, ends, "hinge")
            onset = figures[kind].contact_input_mm
            if onset is not None and not physics.contact and inputs.min() < onset * (1.0 + 1e-9):
                click.echo(
                    f"Warning: the fingers touch at an input of {onset:.4g} mm, and from there to {inputs.min():.4g} "
                    f"mm they pass through each other, because contact is not computed: add --contact.",
                    err=True,
                )
            break
    if as_json:
        return
    for kind in figures:
        if small_displacements_alone(kind) and len(models) > 1 and physics != Physics():
            click.echo(f"Note: the model kind {kind} always computes small displacements without contact.")


def _warn_of_stress(gripper: Gripper, model: Any, inputs: NDArray[np.float64]) -> None:
    limit = gripper.material.yield_mpa
    states = [s for s in model.loaded([float(inputs.min()), float(inputs.max())]) if s.stress_mpa > limit]
    for state in states:
        click.echo(
            f"Warning: at an input of {state.input_mm:.3g} mm the stress at ({state.place_mm[0]:.4g}, "
            f"{state.place_mm[1]:.4g}) must stay below the yield of {limit:g} MPa, but is {state.stress_mpa:.3g} MPa, "
            f"{state.stress_mpa - limit:.3g} MPa too much; stay within "
            f"{input_at_yield_mm(model, state.input_mm, limit):.3g} mm.",
            err=True,
        )


_MOST_NECKS = 3
_LEAST_PERCENT = 0.05


def say_refusals(refusals: Mapping[str, FingervisionError]) -> None:
    """Print which kinds of model could not be computed, beside those that could."""
    for name, refusal in refusals.items():
        click.echo(f"{name} could not be computed: {refusal}", err=True)


def say_drawing(mechanism: Mechanism, figures: Mapping[str, float]) -> None:
    """Print what is treated as a flexure without a name, what the drives do, and the effect of the plate's width."""
    for words in mechanism.notes:
        click.echo(words)
    for strip in mechanism.strips:
        x, y = strip.at_mm
        click.echo(
            f"{strip.name} at ({x:.4g}, {y:.4g}) mm, {strip.thickness_mm:.4g} mm thick and "
            f"{2.0 * strip.half_length_mm:.4g} mm long, is treated as a flexure: it is much thinner than what it joins."
        )
    for leaf, other, (x, y) in mechanism.fused:
        click.echo(f"The leaves {leaf} and {other} cross at ({x:.4g}, {y:.4g}) mm, where they are one piece.")
    if mechanism.layers:
        each = zip(mechanism.body_names, mechanism.layers, strict=True)
        names = sorted({name or "a body without a name" for name, own in each if len(own) > 1})
        click.echo(
            f"The layers {', '.join(map(str, mechanism.by_layer))}, each {mechanism.plate_mm:g} mm thick, are joined "
            f"only by {', '.join(names)}."
        )
    if (ends := mechanism.sharp_ends) and "peak_stress_mpa_per_mm" in figures:
        click.echo(
            f"Stress within half a thickness of the corners without a radius at {', '.join(ends[:_MOST_NECKS])} is "
            "left out, because it has no limit there: round them for a stress that holds."
        )
    for drive in mechanism.drives:
        click.echo(drive.words)
    say_width(mechanism.plate_mm, figures)


def say_width(plate_mm: float, figures: Mapping[str, float | None]) -> None:
    """Print by how much the plate's width raises the force."""
    if (percent := figures.get("width_effect_force_percent") or 0.0) >= _LEAST_PERCENT:
        click.echo(
            f"The plate's width of {plate_mm:g} mm restrains the flexures, which makes the force "
            f"{percent:.2g} % higher than beam formulas with Young's modulus (plane stress)."
        )


def warn(
    mechanism: Mechanism,
    model: MechanismModel,
    states: Sequence[MechanismState],
    figures: Mapping[str, float],
    *,
    contact: bool,
) -> None:
    """Warn of yielding, buckling, necks that are no flexures, and faces that penetrate each other."""
    if (corner := getattr(model, "unstated_stress_at_mm", None)) is not None:
        click.echo(
            "Warning: the stress is not stated, because the outline has a re-entrant corner without a radius, or a "
            f"face ends, at ({corner[0]:.4g}, {corner[1]:.4g}) mm, where it has no limit: round the corner, let the "
            "face turn, or draw the thin strip there as a [[flexure]].",
            err=True,
        )
    necks = [
        neck
        for layer, region in mechanism.by_layer.items()
        for neck in necks_of(region, [flexure for flexure in mechanism.flexures if flexure.layer == layer])
    ]
    for (x, y), thickness in necks[:_MOST_NECKS]:
        click.echo(
            f"Warning: the drawing is only {thickness:.3g} mm thick at ({x:.4g}, {y:.4g}) mm, where it names no "
            "flexure: move the shapes apart there, or draw the neck as a [[flexure]], as its stress is not judged.",
            err=True,
        )
    if (stiffness := figures["input_stiffness_n_mm"]) <= 0.0:
        click.echo(
            f"Warning: the preload makes the stiffness at the drive negative, {stiffness:.3g} N/mm: the mechanism "
            "stays at rest only while a stage holds its input, and moves away from there without one.",
            err=True,
        )
    ends = [state.input_mm for state in (states[0], states[-1])]
    if min(ends) <= figures.get("input_at_buckling_mm", np.inf) <= max(ends):
        click.echo(
            f"Warning: a flexure buckles at an input of {figures['input_at_buckling_mm']:.3g} mm, before it yields; "
            "results beyond do not hold: load it less, or make it thicker or shorter.",
            err=True,
        )
    worst = max(states, key=lambda state: state.stress_mpa)
    if worst.stress_mpa > mechanism.material.yield_mpa:
        click.echo(
            f"Warning: at an input of {worst.input_mm:.3g} mm the stress in the flexures must stay below the yield "
            f"stress of {mechanism.material.yield_mpa:g} MPa, but is {worst.stress_mpa:.3g} MPa; keep the input within "
            f"{figures['input_at_yield_mm']:.3g} mm.",
            err=True,
        )
    for name, at_mm in model.touch_input_mm().items():
        if not contact and min(ends) < at_mm < max(ends):
            click.echo(
                f"Warning: the faces of contact {name} touch at an input of {at_mm:.4g} mm; beyond this input, the "
                f"faces pass through each other, because contact is not computed: add --contact.",
                err=True,
            )


def add_endurance(mechanism: Mechanism, states: Sequence[MechanismState], figures: dict[str, float]) -> None:
    """Add the number of load cycles to failure over the range of inputs, if the material has an S-N line.

    The stress is assumed to change its sign with the input.
    """
    life = life_over(mechanism.material, states)
    if life is not None and life.cycles is not None:
        figures["endurance_cycles"] = life.cycles


def say_endurance(
    kind: str, material: Material, states: Sequence[LoadedState | MechanismState], where: str = "flexures"
) -> None:
    """Print the number of load cycles that the flexures endure over the range of inputs."""
    life = life_over(material, states)
    if life is not None:
        click.echo(
            f"Endurance between {states[0].input_mm:.3g} and {states[-1].input_mm:.3g} mm ({kind}, the material's S-N "
            f"line, no scatter): {life.words}; the stress in the {where} changes by "
            f"+-{life.amplitude_mpa:.3g} MPa about {life.mean_mpa:.3g} MPa."
        )
