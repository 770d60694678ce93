"""Response of a gripper to a drive history in time, with the physics that its model includes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ModelError
from fingervision.domain.response import Response
from fingervision.models.damping import Damping, ModalDamping
from fingervision.models.generalized_alpha import integrate
from fingervision.models.gripper_model import DrawnGripper
from fingervision.models.modal_model import GAP, Motion, described, modal_motion, run_rows

# Motion of the gripper in time, in the deformed shape or with contact, integrated step by step.

Array = NDArray[np.float64]

_PENALTY = 20.0
"""Ratio of each face point's contact stiffness to the finger's own stiffness: under a grip of 1 N the face penetrates
by a twentieth of the finger's own deflection (0.02 mm for the published sample)."""
_A_PERIOD = 60
"""Time steps per period of the lowest mode: the difference of the gap from the exact modal solution is then below 0.1 %
of the gap's travel."""
_RESOLVED_MODES = 3
"""Number of modes that the time step resolves. The third mode of the published sample has six times the frequency of
the first: ten steps per period."""
_OVERDAMPED = 1.0
"""Damping ratio of the first mode that the time step does not resolve; it is larger for higher modes."""
_RADIUS = 0.5
"""Spectral radius at infinite frequency: vibrations too fast for the step decay within a few steps; they are excited by
kinks of the drive history, not by the mechanism."""


class ReducedMotion:
    """A gripper whose motion is integrated in time: the free motions of its elastic model, and the input.

    The motion by the input includes that of the free masses which are coupled to driven ones, so that in these unknowns
    the mass of the input is coupled to no other: a jump of the input's speed is then no impulse on the others.

    Parameters
    ----------
    model : DrawnGripper
        The gripper, with its physics.
    """

    def __init__(self, model: DrawnGripper) -> None:
        self.model = model
        self._system = system = model.elastic.vibrating(_RESOLVED_MODES + 1)
        motions, by_input = system.motions.toarray(), system.by_input
        coupled = motions.T @ (system.mass_t @ by_input)
        if np.any(coupled):
            by_input = by_input - motions @ np.linalg.solve(motions.T @ (system.mass_t @ motions), coupled)
        self._columns = np.column_stack([motions, by_input])
        self._mass_t = self._columns.T @ (system.mass_t @ self._columns)
        static = np.zeros(system.unknowns)
        static[: model.elastic.driven.unknowns] = model.elastic.driven.unit_displacement
        self._static = np.append(np.linalg.lstsq(motions, static - by_input, rcond=None)[0], 1.0)

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return int(self._columns.shape[1])

    @property
    def step_s(self) -> float:
        """Time step (s): a sixtieth of the period of the lowest mode with fixed drive."""
        rad_s, _, _ = self._system.modes(drive_held=True, count=1)
        return float(2.0 * pi / rad_s[0] / _A_PERIOD)

    def over(self, drive: DriveHistory, damping: Damping, step_s: float) -> tuple[Array, Array]:
        """Gap and force over one run, with the drive's motion prescribed.

        Parameters
        ----------
        drive : DriveHistory
            Inputs over time, linear between samples.
        damping : Damping
            Damping of the modes at rest; it acts on the motion relative to the static shape, as in `modal_model`.
        step_s : float
            Largest time step.

        Returns
        -------
        gap_mm, force_n : ndarray of float, shape (n,)
            Gap and force at the drive's samples. The drive's own inertia is not in the force, because the speed of the
            drive jumps between straight pieces of its history.
        """
        usual_s = float(np.median(np.diff(drive.time_s))) if drive.time_s.size > 1 else step_s
        # The steps divide the spacing of the samples, so that kinks of the drive history lie at the ends of steps.
        step_s = usual_s / np.ceil(usual_s / step_s)
        steps = max(1, int(np.ceil((drive.time_s[-1] - drive.time_s[0]) / step_s - 1e-9)))
        time_s = drive.time_s[0] + np.arange(steps + 1) * step_s
        history = np.interp(time_s, drive.time_s, drive.input_mm)
        start, last = history[0] * self._static, self.unknowns - 1
        motion = integrate(
            csr_matrix(self._mass_t),
            self._drag(damping),
            self._internal,
            (start, np.zeros_like(start)),
            (np.array([last]), history),
            np.arange(last),
            step_s,
            high_frequency_radius=_RADIUS,
        )
        gap = np.array([self._gap_mm(row) for row in motion.displacement])
        force = np.array([self._internal(u)[1][last] for u in motion.displacement])
        return np.interp(drive.time_s, time_s, gap), np.interp(drive.time_s, time_s, force)

    def _gap_mm(self, reduced: Array) -> float:
        elastic, large = self.model.elastic, self.model.physics.large_rotation
        moved = (self._columns @ reduced)[: None if not large else elastic.driven.unknowns]
        return elastic.pairs_mm(moved, large=large)["gap"]

    @cached_property
    def _penalty_n_mm(self) -> Array:
        driven = self.model.elastic.driven
        slope = driven.gaps[0](np.zeros(driven.unknowns))[1]
        return np.asarray(_PENALTY / np.einsum("ij,ji->i", slope.toarray(), driven.under_load(slope.toarray().T)))

    def _internal(self, reduced: Array) -> tuple[csr_matrix, Array]:
        system, physics, columns = self._system, self.model.physics, self._columns
        moved = columns @ reduced
        if physics.large_rotation:
            tangent, force = system.tangent(moved)
        else:
            tangent, force = system.stiffness_n_mm, system.stiffness_n_mm @ moved
        if physics.contact:
            gap, slope, _ = system.gaps[0](moved)
            active = self._penalty_n_mm * (gap < 0.0)
            tangent = csr_matrix(tangent + slope.T @ diags(active) @ slope)
            force = force + slope.T @ (active * gap)
        return csr_matrix(columns.T @ (tangent @ columns)), np.asarray(columns.T @ force)

    def _drag(self, damping: Damping) -> csr_matrix:
        """Damping matrix for motion relative to the static shape.

        For the modes that the damping law describes and the time step resolves, the damping matrix is M Phi diag(2 zeta
        w) Phi' M, with the mass matrix M, the mode shapes Phi, the damping ratios zeta and the angular frequencies w.
        Modes that the damping law does not describe, or the time step does not resolve, have a damping proportional to
        their stiffness, so strong that these modes follow the drive without delay, as in `modal_model`.
        """
        ratios = described(damping, self._system.modes(drive_held=True, count=_RESOLVED_MODES)[0])
        rad_s, shapes, _ = self._system.modes(drive_held=True, count=_RESOLVED_MODES + 1)
        described_rad_s = rad_s[: ratios.size]
        pushed = self._columns.T @ (self._system.mass_t @ shapes[:, : ratios.size])
        matrix = (pushed * (2.0 * ratios * described_rad_s)) @ pushed.T
        stiffness = self._columns.T @ (self._system.stiffness_n_mm @ self._columns)
        rest = stiffness - (pushed * described_rad_s**2) @ pushed.T
        matrix += 2.0 * _OVERDAMPED / rad_s[ratios.size] * rest
        matrix[:, -1] -= matrix @ self._static
        return csr_matrix(matrix)


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
    damping : ModalDamping, RayleighDamping or PaperDamping
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
