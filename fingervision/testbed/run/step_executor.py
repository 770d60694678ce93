"""Execute one segment of a recipe's plan: move, rest, oscillate, close until contact, measure a slot."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import sin, sqrt, tau
from typing import Any

import numpy as np

from calib.errors import CalibrationError
from calib.known_widths import KnownSize, find_widths
from fingervision.domain.errors import DeviceError
from fingervision.domain.frame import Frame
from fingervision.domain.numbers import with_uncertainty
from fingervision.domain.status import Status
from fingervision.measuring.scale import Scale
from fingervision.storage.gaps_csv import GapRow
from fingervision.testbed.bed import TAKE_OUT_SLOT, put_in_slot
from fingervision.testbed.recipe_kinds import Act, Close, Frames, Go, Slot, Stand, Swing
from fingervision.testbed.run.safety_monitor import Watch
from fingervision.testbed.run.synchronised_acquisition import Look
from fingervision.vision.grey import to_grey

# Measure a reference slot of known width in place of the gripper, to check the scale.


def measured_slot(frames: Sequence[Frame], size_mm: float, scale: Scale) -> dict[str, float]:
    """Measure a slot in every frame.

    Parameters
    ----------
    frames : sequence of Frame
        Frames of the slot at rest.
    size_mm : float
        Known width of the slot.
    scale : Scale
        Scale of the test bed's camera.

    Returns
    -------
    dict
        `measured_mm` (mean over the frames), `u_random_mm` (its standard uncertainty), `ratio` (measured over known
        width).

    Raises
    ------
    DeviceError
        No slot is visible.
    """
    pictures = [KnownSize(f"frame {frame.index}", "slot", size_mm, 0.0, to_grey(frame.pixels)) for frame in frames]
    try:
        widths = [find_widths([picture], px_per_mm=scale.px_per_mm)[0] for picture in pictures]
    except CalibrationError as error:
        raise DeviceError(
            f"The reference slot of {size_mm:g} mm must be visible, but was not measured: {error}"
        ) from error
    if not widths:
        raise DeviceError(f"The reference slot of {size_mm:g} mm must be visible, but the camera gave no frame.")
    points = np.array([width.points_px for width in widths])
    u_px = np.array([width.u_width_px for width in widths])
    found = scale.distances(points, u_px, np.array([width.light for width in widths]))
    mean_mm = float(np.mean(found.value_mm))
    # The uncertainty of the mean follows from the scatter of the frames, or from the scatter of the rows within a
    # frame, whichever is larger.
    scatter_mm = float(np.std(found.value_mm, ddof=1)) / sqrt(len(widths)) if len(widths) > 1 else 0.0
    u_mm = max(scatter_mm, float(np.mean(found.u_random_mm)) / sqrt(len(widths)))
    return {"measured_mm": mean_mm, "u_random_mm": u_mm, "ratio": mean_mm / size_mm}


# A picture counts as at rest if the gaps of STILL_FRAMES successive frames differ by less than STILL_SIGMAS times their
# uncertainty.
STILL_FRAMES, STILL_SIGMAS = 4, 4.0
# A picture that is not at rest after this time is measured nevertheless, with a note in the events.
STILL_WITHIN_S = 5.0
# Rest after homing, because a moving stage would give a wrong reference.
REST_AFTER_HOMING_S = 1.0
# Number of frames per piece of the motion that approximates a sine.
SWING_FRAMES = 3
SLOT_FRAMES = 10


def go(watch: Watch, act: Go) -> None:
    """Move to a position."""
    watch.follow(partial(watch.bed.actuator.move, act.to_mm, act.speed_mm_s), record=act.frames is None)
    if act.frames is None:
        # Record a frame at each reversal: effects with memory depend on its position, which samples beside it do not
        # show.
        watch.see(record=True)
    _point(watch, act.frames)


def stand(watch: Watch, act: Stand) -> None:
    """Rest for a time."""
    until_s = watch.now_s + act.seconds
    while watch.now_s < until_s:
        watch.see(record=act.frames is None)
        watch.wait_while_paused(record=act.frames is None)
    _point(watch, act.frames)


def swing(watch: Watch, act: Swing) -> None:
    """Move the stage sinusoidally, in short pieces."""
    began_s, piece_s = watch.now_s, SWING_FRAMES / watch.sight.rate_hz
    lasts_s = act.cycles / act.frequency_hz
    at_mm = act.mean_mm
    while (now_s := watch.now_s - began_s) < lasts_s:
        then_s = min(now_s + piece_s, lasts_s)
        to_mm = act.mean_mm + act.amplitude_mm * sin(tau * act.frequency_hz * then_s)
        if abs(to_mm - at_mm) > 1e-9 and then_s > now_s:
            speed_mm_s = max(abs(to_mm - at_mm) / (then_s - now_s), 1e-3)
            watch.follow(partial(watch.bed.actuator.move, to_mm, speed_mm_s), record=True)
            at_mm = to_mm
        if watch.now_s - began_s <= now_s:
            watch.see(record=True)


def close(watch: Watch, act: Close) -> None:
    """Close the gripper until the force limit is reached, the fingers touch, or the test bed's limit is reached."""
    felt: list[str] = []

    def met(look: Look, row: GapRow) -> bool:
        if look.force_now_n is not None and abs(look.force_now_n) >= act.below_force_n:
            felt.append(f"the force of {act.below_force_n:g} N was reached")
        elif row.status is Status.TOUCHING:
            felt.append("the fingers touch in the picture")
        return bool(felt)

    bed = watch.bed
    watch.follow(partial(bed.actuator.move, bed.limits.lower_mm, act.speed_mm_s), record=True, until=met)
    why = felt[0] if felt else "no contact was found before the position reached the test bed's limit"
    watch.record.event("closed", f"Closing ended: {why}.", input_mm=watch.sight.position.newest)


MOTIONS: Mapping[type[Act], Callable[[Watch, Any], None]] = {Go: go, Stand: stand, Swing: swing, Close: close}
"""What executes each kind of motion."""


def rezero(watch: Watch) -> None:
    """Reference the stage again, and wait for a pause."""
    watch.follow(watch.bed.actuator.home, record=False)
    stand(watch, Stand(REST_AFTER_HOMING_S, frames=0))


def slot(watch: Watch, act: Slot) -> dict[str, float]:
    """Request a reference slot, measure it, and request its removal; return the result for run.json."""
    bed, scale = watch.bed, watch.bed.scale
    bed.operate(put_in_slot(act.size_mm))
    watch.look()
    items = [watch.look().shot.item() for _ in range(SLOT_FRAMES)]
    bed.operate(TAKE_OUT_SLOT)
    assert scale is not None  # noqa: S101 - a sight was made of it
    found = {
        "size_mm": act.size_mm,
        "u_size_mm": act.u_size_mm,
        **measured_slot([item for item in items if isinstance(item, Frame)], act.size_mm, scale),
    }
    words = (
        f"The slot of {act.size_mm:g} mm measures {with_uncertainty(found['measured_mm'], found['u_random_mm'])} mm."
    )
    watch.record.event("reference_slot", words, **found)
    watch.say(words)
    watch.find_fingers()
    return found


def _point(watch: Watch, frames: Frames) -> None:
    """Record the requested number of frames once the picture is at rest."""
    if not frames:
        return
    _settle(watch)
    for _ in range(frames):
        watch.see(record=True)
        watch.wait_while_paused(record=False)


def _settle(watch: Watch) -> None:
    """Wait until the picture is at rest."""
    until_s = watch.now_s + STILL_WITHIN_S
    last: list[GapRow] = []
    while watch.now_s < until_s:
        _, row = watch.see(record=False)
        last = [*last[-STILL_FRAMES + 1 :], row]
        if len(last) == STILL_FRAMES and _still(last):
            return
    words = f"The picture was not at rest after {STILL_WITHIN_S:g} s, and is measured nevertheless."
    watch.record.event("not_still", words)


def _still(rows: list[GapRow]) -> bool:
    """Whether successive frames show the same gap, or no gap."""
    gaps = [row.gap_mm for row in rows if row.gap_mm is not None]
    if len(gaps) < len(rows):
        return not gaps
    u = max(row.u_random_mm or 0.0 for row in rows)
    return max(gaps) - min(gaps) < STILL_SIGMAS * u
