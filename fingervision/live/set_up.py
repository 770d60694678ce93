"""Inspection of the set-up in a live view: `inspect` applied to the newest frames, while the measurement continues."""

from time import monotonic, sleep
from typing import Any

from fingervision.domain.errors import StateError
from fingervision.domain.frame import Frame
from fingervision.inspection.catalogue import inspect
from fingervision.inspection.report import as_json
from fingervision.inspection.sample import take_sample
from fingervision.live.view import View

# Duration as in the command `inspect` for a camera; enough frames to average noise and to detect vibration.
LOOKS_FOR_S, MOST_FRAMES, FEWEST_FRAMES = 3.0, 40, 5
LOOK_EVERY_S = 0.005


class SetUp:
    """One inspection of the set-up.

    Parameters
    ----------
    view : View
        The live measurement, whose scale must be known.

    Raises
    ------
    FingervisionError
        The scale is not known.
    """

    def __init__(self, view: View) -> None:
        if view.choices.task is None:
            raise StateError("An inspection states errors in micrometres, which needs the scale: give the scale first.")
        self.findings: list[dict[str, Any]] | None = None
        self.words = "Frames are collected for three seconds."
        self._view = view
        self._thread = view.supervisor.start("Inspecting the set-up", self._look, self._failed)

    @property
    def is_busy(self) -> bool:
        """Whether an inspection is running."""
        return self._thread.is_alive()

    def _look(self) -> None:
        frames = self._frames()
        task = self._view.choices.task
        if task is None or len(frames) < FEWEST_FRAMES:
            self.words = f"Only {len(frames)} frames arrived in {LOOKS_FOR_S:g} s: check the camera or stream first."
            return
        self.words = f"{len(frames)} frames are being inspected."
        settings, _ = task.settings_for(self._view.description.files)
        sample = take_sample(frames, self._view.description, settings, task.scale)
        report = as_json(sample, inspect(sample))
        self.findings = report["findings"]
        self.words = (
            f"{len(frames)} frames inspected: nothing has to be changed."
            if report["nothing_to_mend"]
            else f"{len(frames)} frames inspected."
        )

    def _failed(self, why: str) -> None:
        self.words = why

    def _frames(self) -> list[Frame]:
        found: list[Frame] = []
        until_s = monotonic() + LOOKS_FOR_S
        while monotonic() < until_s and len(found) < MOST_FRAMES:
            seen = self._view.seen
            if seen is not None and (not found or seen.frame is not found[-1]):
                found.append(seen.frame)
            sleep(LOOK_EVERY_S)
        return found
