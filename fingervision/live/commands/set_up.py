"""Requests about the set-up: findings with remedies, focus and light, uncertainty budget, saved settings."""

from time import monotonic, sleep
from typing import Any

import numpy as np

from calib.measured_scale import Calibration
from fingervision.domain.direction import Direction
from fingervision.domain.errors import StateError
from fingervision.domain.frame import Frame, Region
from fingervision.domain.gap import GapMeasurement
from fingervision.inspection.catalogue import inspect
from fingervision.inspection.report import as_json
from fingervision.inspection.sample import take_sample
from fingervision.live.commands.asking import Answer, Request, check_scale, file_inside
from fingervision.live.playback.playback import Playback
from fingervision.live.view import View
from fingervision.measuring.gap_budget import gap_budget
from fingervision.measuring.scale import stated_scale
from fingervision.storage.calibration_json import read_calibration
from fingervision.storage.settings_toml import read_settings, write_settings
from fingervision.vision.grey import full_scale, to_grey

# Inspection of the set-up in a live view: `inspect` applied to the newest frames, while the measurement continues.


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


SET_UP, FILE = "set_up", "settings.toml"
STEP_PX, BRIGHTEST_PERCENT = 8, 99.0


def _inspect(view: View, request: Request) -> Answer:
    if isinstance(view, Playback) and not view.is_playing:
        view.play(on=True, speed=1.0)
    running = view.features.get(SET_UP)
    if isinstance(running, SetUp) and running.is_busy:
        raise StateError("The set-up is being inspected already: wait until the inspection is done.")
    view.features[SET_UP] = SetUp(view)
    return Answer()


def _save(view: View, request: Request) -> Answer:
    path = view.out / FILE
    write_settings(path, view.choices.settings())
    return Answer(f"Settings written to {path}; `measure`, `live`, `inspect` and this page take them.")


def _load(view: View, request: Request) -> Answer:
    path = file_inside(view, request, "path", "A settings file")
    found = read_settings(path)
    changes: dict[str, Any] = {}
    if "calibration" in found:
        changes |= {"scale": read_calibration(found["calibration"]), "scale_file": found["calibration"]}
    if "px_per_mm" in found:
        changes |= {"scale": stated_scale(found["px_per_mm"], found.get("u_px_per_mm")), "scale_file": None}
    if "below_tip_mm" in found:
        changes["below_tip_mm"] = found["below_tip_mm"]
    if "tips" in found:
        changes["direction"] = None if found["tips"] == "auto" else Direction(found["tips"])
    if "fingers" in found:
        changes["fingers"] = found["fingers"]
    if "roi" in found:
        changes["region"] = Region(*(int(side) for side in found["roi"].split(",")))
    if "scale" in changes:
        check_scale(view, changes["scale"].px_per_mm, request)
    view.choose(**changes)
    return Answer(f"Settings of {path} are used{'; those of the camera at the next start' * ('camera' in found)}.")


def section(view: View) -> dict[str, Any]:
    """Return findings, indicators and uncertainty budget for the browser page."""
    looked = view.features.get(SET_UP)
    found = looked if isinstance(looked, SetUp) else None
    return {
        "set_up": {
            "busy": found is not None and found.is_busy,
            "words": "" if found is None else found.words,
            "findings": None if found is None else found.findings,
        },
        "meters": _meters(view),
        "budget": _budget(view),
    }


def _meters(view: View) -> dict[str, float | None]:
    seen = view.seen
    if seen is None:
        return {"blur_px": None, "contrast": None, "light": None}
    grey = to_grey(np.ascontiguousarray(seen.frame.pixels[::STEP_PX, ::STEP_PX]))  # type: ignore[arg-type]
    scale = full_scale(grey)
    light = float(np.percentile(grey, BRIGHTEST_PERCENT)) / scale
    if not isinstance(seen.outcome, GapMeasurement):
        return {"blur_px": None, "contrast": None, "light": light}
    edges = (seen.outcome.left, seen.outcome.right)
    return {
        "blur_px": max(edge.blur_px for edge in edges),
        "contrast": min(abs(edge.contrast) for edge in edges) / scale,
        "light": light,
    }


def _budget(view: View) -> list[list[Any]] | None:
    """Contributions to the displayed gap's uncertainty, largest first: source, micrometres (k = 1), assumption."""
    seen, scale = view.seen, view.choices.scale
    if seen is None or not isinstance(scale, Calibration) or not isinstance(seen.outcome, GapMeasurement):
        return None
    outcome = seen.outcome
    lines = sorted(gap_budget([outcome], scale).lines, key=lambda line: -float(line.u_mm[0]))
    return [[line.source, 1e3 * float(line.u_mm[0]), line.supplied] for line in lines]


COMMANDS = {"inspect": _inspect, "save_settings": _save, "load_settings": _load}
