"""The simulated set-up: a gripper with effects, integrated in time on a grid finer than the frames."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden import camera_plant, drive_plant, mechanism_plant
from tests.benchmarks.hidden.foreign import FOREIGN, Foreign, Moment
from tests.benchmarks.hidden.gripper_table import GripperTable, InputRange
from tests.benchmarks.hidden.motion import Motion

Array = NDArray[np.float64]
FINE_STEPS = 12
"""Integration steps per frame."""


@dataclass(frozen=True, slots=True)
class Hidden:
    """A simulated effect, by its name in the catalogue, with its parameters."""

    name: str
    parameters: dict[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """One simulated run at the times of the frames, without noise.

    Parameters
    ----------
    run_time_s : ndarray, shape (n,)
        Time since the run's first frame.
    table_time_s : ndarray, shape (n,)
        Time since the table's first frame.
    input_mm, left_mm, right_mm, force_n : ndarray, shape (n,)
        True input, edges and force.
    """

    run_time_s: Array
    table_time_s: Array
    input_mm: Array
    left_mm: Array
    right_mm: Array
    force_n: Array


@dataclass(frozen=True, slots=True, eq=False)
class Plant:
    """A gripper with simulated effects.

    Parameters
    ----------
    table : GripperTable
        Simulation table of the gripper without effects.
    inputs : InputRange
        Range of the runs.
    hidden : tuple of Hidden
        Simulated effects; they act in their physical order.
    foreign : Foreign or None
        An effect from outside the catalogue.
    total_s : float
        Duration of the whole experiment.
    placement_mm : float
        Distance of the gripper from the image centre, on which camera effects depend.
    run_start : tuple of float
        Start states of plays and frictions in each run, from -1 to 1; centred for further runs.
    """

    table: GripperTable
    inputs: InputRange
    hidden: tuple[Hidden, ...] = ()
    foreign: Foreign | None = None
    total_s: float = 1.0
    placement_mm: float = 0.0
    run_start: tuple[float, ...] = ()
    _by_name: dict[str, dict[str, float]] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_by_name", {h.name: h.parameters for h in self.hidden})

    def trace(self, motion: Motion, rate_hz: float, started_s: float, run: int) -> Trace:
        """Simulate one motion from rest, and return it at the times of the frames."""
        dt = 1 / rate_hz / FINE_STEPS
        frames = int(np.floor(motion.duration_s * rate_hz + 1e-9)) + 1
        time_s = np.arange((frames - 1) * FINE_STEPS + 1) * dt
        u = motion.at(time_s)
        driven = self._drive(time_s, u, self.run_start[run] if run < len(self.run_start) else 0.0)
        gap, midline = self._mechanism(driven, dt, started_s + time_s)
        left, right = self.placement_mm + midline - gap / 2, self.placement_mm + midline + gap / 2
        if self.foreign is not None:
            way = np.gradient(u, dt)
            moment = Moment(
                (started_s + time_s) / self.total_s,
                (u - self.inputs.lower_mm) / self.inputs.width_mm,
                np.tanh(way / (0.02 * self.inputs.width_mm)),
                run,
            )
            more_left, more_right = FOREIGN[self.foreign.name](self.foreign, moment)
            left, right = left + more_left, right + more_right
        left, right = self._camera(left, right, gap, started_s + time_s)
        if "camera_latency" in self._by_name:
            delay_s = self._by_name["camera_latency"]["delay_s"]
            left, right = drive_plant.late(time_s, left, delay_s), drive_plant.late(time_s, right, delay_s)
        force = self.table.force(driven) * (1 + self._by_name.get("hinge_stiffness_error", {}).get("ratio", 0.0))
        at = slice(None, None, FINE_STEPS)
        return Trace(time_s[at], started_s + time_s[at], u[at], left[at], right[at], force[at])

    def _drive(self, time_s: Array, u: Array, start: float) -> Array:
        acting = self._by_name
        if "drive_lag" in acting:
            u = drive_plant.late(time_s, u, **acting["drive_lag"])
        u = u + acting.get("input_offset", {}).get("offset_mm", 0.0)
        u = u * (1 + acting.get("input_scale", {}).get("ratio", 0.0))
        if "encoder_cyclic_error" in acting:
            u = drive_plant.cyclic_error(u, **acting["encoder_cyclic_error"])
        if "end_stop" in acting:
            u = drive_plant.stopped(u, acting["end_stop"].get("lower_mm"), acting["end_stop"].get("upper_mm"))
        if "position_error_map" in acting:
            heights = np.array(list(acting["position_error_map"].values()))
            u = drive_plant.mapped(u, (self.inputs.lower_mm, self.inputs.upper_mm), heights)
        if "slew_limit" in acting:
            u = drive_plant.limited(time_s, u, **acting["slew_limit"])
        if "backlash" in acting:
            u = drive_plant.backlash(u, **acting["backlash"], start=start)
        if "stick_slip" in acting:
            u = drive_plant.stick_slip(u, acting["stick_slip"]["jump_mm"], FINE_STEPS)
        if "friction_hysteresis" in acting:
            p = acting["friction_hysteresis"]
            law = drive_plant.dahl_friction if p["dahl"] else drive_plant.slider_friction
            u = law(u, p["fraction"], p["reach_mm"], start)
        return u

    def _mechanism(self, u: Array, dt: float, table_time_s: Array) -> tuple[Array, Array]:
        acting = self._by_name
        opening = self.table.gap(u) - self.table.rest_gap_mm
        midline = self.table.midline(u)
        opening = opening * (1 + acting.get("lever_ratio_error", {}).get("ratio", 0.0))
        if "large_deflection" in acting:
            opening = mechanism_plant.arc(opening, **acting["large_deflection"])
        if "viscoelastic_creep" in acting:
            shares = np.array([acting["viscoelastic_creep"][f"share_{k}"] for k in range(5)])
            opening = mechanism_plant.creep(opening, dt, shares)
        if "structural_resonance" in acting:
            opening = mechanism_plant.resonance(opening, dt, **acting["structural_resonance"])
        gap = self.table.rest_gap_mm + opening + acting.get("rest_gap_error", {}).get("offset_mm", 0.0)
        midline = midline + acting.get("assembly_asymmetry", {}).get("share", 0.0) * opening
        if "finger_contact" in acting:
            gap = mechanism_plant.soft_contact(gap, **acting["finger_contact"])
        if "thermal_drift" in acting:
            gap = gap + mechanism_plant.warming(table_time_s, **acting["thermal_drift"])
        return gap, midline

    def _camera(self, left: Array, right: Array, gap: Array, table_time_s: Array) -> tuple[Array, Array]:
        acting = self._by_name
        points = []
        bias = acting.get("edge_bias", {}).get("offset_mm", 0.0)
        for x, side in ((left, -1), (right, 1)):
            y = x + acting.get("camera_drift", {}).get("rate_mm_per_s", 0.0) * table_time_s
            y = y * (1 + acting.get("camera_scale_drift", {}).get("rate_per_s", 0.0) * table_time_s)
            if "out_of_plane_motion" in acting:
                y = camera_plant.nearer(y, gap - self.table.rest_gap_mm, **acting["out_of_plane_motion"])
            y = y * (1 + acting.get("scale_error", {}).get("ratio", 0.0))
            if "lens_distortion" in acting:
                y = camera_plant.lens(y, **acting["lens_distortion"])
            if "camera_tilt" in acting:
                y = camera_plant.tilted(y, **acting["camera_tilt"])
            points.append(y + side * bias / 2)
        return points[0], points[1]
