"""Warnings about the limits of the results of the `model` command."""

from collections.abc import Mapping
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import ModelFigures
from fingervision.models.gripper_figures import input_at_yield_mm, life_between
from fingervision.models.kinds import by_trust, small_displacements_alone
from fingervision.models.notch import notches_of
from fingervision.models.physics import Physics


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
                _say_endurance(gripper, kind, models[kind], inputs)
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
        if kind == "stiffness_matrix" and figures[kind].out_of_plane_modes_hz:
            click.echo(_out_of_plane_limit(gripper, figures[kind]))


def _say_endurance(gripper: Gripper, kind: str, model: Any, inputs: NDArray[np.float64]) -> None:
    ends = model.loaded([float(inputs.min()), float(inputs.max())])
    life = life_between(gripper, *((s.input_mm, s.gap_mm, s.force_n, s.grip_n, s.stress_mpa) for s in ends))
    if life is not None:
        click.echo(
            f"Endurance between {ends[0].input_mm:.3g} and {ends[1].input_mm:.3g} mm ({kind}, the material's S-N line, "
            f"no scatter): {life.words}; the stress in the hinge changes by +-{life.amplitude_mpa:.3g} MPa about "
            f"{life.mean_mpa:.3g} MPa."
        )


def _out_of_plane_limit(gripper: Gripper, figures: ModelFigures) -> str:
    wide = max(notch.plate_mm / notch.thickness_mm for notch in notches_of(gripper))
    return (
        "Note: the model kind stiffness_matrix joins bars at points and computes the torsion of a hinge between rigid "
        f"planes. At a width over thickness of {wide:.3g}, its first frequency out of the plane is exact within "
        f"{100.0 * figures.out_of_plane_error:.2g} %, its sag within {100.0 * figures.sag_error:.2g} %. The model kind "
        "finite_element has three dimensions: its first frequency is exact within 1 %, its sag within 2 %."
    )


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
