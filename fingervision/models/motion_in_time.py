"""Response of a gripper to a drive history in time, with the physics that its model includes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ModelError
from fingervision.domain.response import Response
from fingervision.models.damping import Damping, ModalDamping
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.modal_model import GAP
from fingervision.models.modal_response import Motion, modal_motion, run_rows
from fingervision.models.stepped_response import ReducedMotion

Array = NDArray[np.float64]

MODES = 8
"""Number of modes with the drive held. The ninth mode of the published sample is at 9.6 kHz and has a tenth of a per
cent of the moving mass."""
_MOST_STEPS, _MOST_UNKNOWNS = 20_000, 400
"""Largest number of time steps, and of unknowns, for an integration step by step: it then takes at most half a minute,
and only frames of bars have so few unknowns."""
_FAST = 0.05
"""Largest vibration that still counts as small beside the motion that deforms the shape, as a share of the gap's
travel."""


@dataclass(frozen=True, slots=True, eq=False)
class GripperMotion:
    """Motion of a gripper over time.

    Parameters
    ----------
    motion : Motion
        Gap and force, the static response with the same physics, and the damping.
    method : str
        Method of computation, in words for the report.
    """

    motion: Motion
    method: str

    @property
    def gap_mm(self) -> Array:
        """Gap at the drive's samples, shape (n,)."""
        return self.motion.observed_mm[GAP]

    @property
    def response(self) -> Response:
        """Positions of both measuring points, and the force."""
        return Response(-0.5 * self.gap_mm, 0.5 * self.gap_mm, self.motion.force_n)


def gripper_motion(
    model: DrawnGripper, drive: DriveHistory, damping: Damping | None = None, *, modes: int = MODES
) -> GripperMotion:
    """Compute the motion over a drive history; each run begins at rest at its first input.

    With small displacements the modes' equations are solved exactly. With large rotation or contact, a frame of bars is
    integrated in time steps if at most 20 000 steps are needed. If more steps are needed, or the model is no frame of
    bars, the modes of the gripper at rest are superposed on its equilibria while the fingers do not touch. The
    superposition of modes on equilibria is valid for small vibrations.

    Parameters
    ----------
    model : DrawnGripper
        Model of the gripper, with its physics.
    drive : DriveHistory
        Inputs over time, linear between samples.
    damping : ModalDamping, LossFactor, RayleighDamping or PaperDamping
        Damping law; None is a modal damping ratio of 0.025.
    modes : int
        Number of modes with the drive held.

    Raises
    ------
    ModelError
        If large rotation or contact occurs together with vibrations that neither method can compute.
    """
    law = damping or ModalDamping()
    small = modal_motion(model.modal_model(modes), drive, law)
    if not model.physics.large_rotation and not model.physics.contact:
        return GripperMotion(small, f"{small.modes_hz.size} modes, exact between the drive's samples")
    answer = model.respond(drive.input_mm)
    force = np.zeros_like(answer.gap_mm) if answer.force_n is None else answer.force_n
    static = {GAP: answer.gap_mm}
    spans_s = [float(np.ptp(drive.time_s[rows])) for rows in run_rows(drive)]
    body = ReducedMotion(model)
    step_s = body.step_s
    if body.unknowns <= _MOST_UNKNOWNS and sum(spans_s) / step_s <= _MOST_STEPS:
        gap = np.zeros_like(answer.gap_mm)
        for rows in run_rows(drive):
            run = DriveHistory(drive.time_s[rows], drive.input_mm[rows])
            gap[rows], force[rows] = body.over(run, law, step_s)
        return GripperMotion(
            replace(small, observed_mm={GAP: gap}, static_mm=static, force_n=force),
            f"generalised-alpha steps of {1e3 * step_s:.3g} ms",
        )
    travel = float(np.ptp(answer.gap_mm))
    if small.vibration_mm(GAP) > _FAST * travel:
        raise ModelError(
            f"With large rotation or contact this drive must be shorter than {_MOST_STEPS * step_s:.3g} s (with --kind "
            f"lumped, a frame of bars), or make the gap vibrate by at most {_FAST:g} of its travel of {travel:.3g} mm, "
            f"but the drive takes {sum(spans_s):.3g} s and the gap vibrates by {small.vibration_mm(GAP):.3g} mm; "
            "shorten the drive, slow it down or leave --large-rotation and --contact off."
        )
    onset_mm = model.contact_onset_mm if model.physics.contact else None
    apart = np.ones_like(force, dtype=bool) if onset_mm is None else drive.input_mm > onset_mm
    motion = about_equilibria(small, static, force, apart)
    return GripperMotion(
        motion,
        f"equilibria, with {small.modes_hz.size} modes of the gripper at rest superposed where the fingers do not "
        "touch",
    )


def check_small_vibration(small: Motion, column: str, travel_mm: float) -> None:
    """Refuse a drive that vibrates a length too strongly for the modes at rest to be superposed on the equilibria.

    Parameters
    ----------
    small : Motion
        Motion for small displacements.
    column : str
        Name of the length.
    travel_mm : float
        Range of the length's equilibria over the drive.

    Raises
    ------
    ModelError
        If the vibration exceeds a twentieth of the travel.
    """
    if (shaken_mm := small.vibration_mm(column)) > _FAST * travel_mm:
        raise ModelError(
            f"With large rotation or contact this drive must make {column.removesuffix('_mm')} vibrate by at most "
            f"{_FAST:g} of its travel of {travel_mm:.3g} mm, but it vibrates by {shaken_mm:.3g} mm; slow the drive "
            "down, or leave --large-rotation and --contact off."
        )


def about_equilibria(
    small: Motion, static_mm: Mapping[str, Array], force_n: Array, apart: NDArray[np.bool_] | None = None
) -> Motion:
    """Superpose the vibration of the modes at rest on equilibria that include large rotation or contact.

    Parameters
    ----------
    small : Motion
        Motion for small displacements.
    static_mm, force_n
        Observed lengths and force in static equilibrium at each input, in the deformed shape or with contact.
    apart : ndarray of bool, shape (n,), or None
        Samples at which the modes vibrate, because nothing touches; None for all.
    """
    free = np.ones(force_n.shape, dtype=bool) if apart is None else apart
    shaken = {name: np.where(free, small.observed_mm[name] - small.static_mm[name], 0.0) for name in static_mm}
    observed = {name: static_mm[name] + shaken[name] for name in static_mm}
    force = force_n + np.where(free, small.inertia_n, 0.0)
    return replace(small, observed_mm=observed, static_mm=dict(static_mm), force_n=force)
