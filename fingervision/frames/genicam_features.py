"""Features of a GenICam camera: requested at the start, stated by the camera, or changeable while the camera runs.

The names of the features are those of the Standard Features Naming Convention (EMVA). Each GenTL producer has exception
classes of its own, so that every exception is caught.
"""

from collections.abc import Mapping
from typing import Any

from fingervision.frames.controls import EXPOSURE, FRAME_RATE, GAIN, CameraControl
from fingervision.frames.source import Wish

MONO = ("Mono8", "Mono10", "Mono12", "Mono14", "Mono16")
"""Pixel formats in which each grey level occupies one or two whole bytes, by their names in the EMVA's Pixel Format
Naming Convention.
"""
NODES = {"exposure_ms": ("ExposureTime", 1e3), "gain": ("Gain", 1.0)}
"""Features of the Standard Features Naming Convention by the options of this program, with factors that convert the
option's unit to the feature's.
"""
CONTROLS = {
    EXPOSURE: (*NODES["exposure_ms"], "ms"),
    GAIN: (*NODES["gain"], "dB"),
    FRAME_RATE: ("AcquisitionFrameRate", 1.0, "Hz"),
}
"""Settings that can be changed while the camera runs: feature, number of its units in one of ours, and our unit."""


def control_list(nodes: Any) -> tuple[CameraControl, ...]:
    """Settings that a camera's features allow to be changed; a feature that is locked now states no value or no limit.

    Parameters
    ----------
    nodes : GenApi's map of nodes
        Map of the camera's features.
    """
    found = []
    for name, (node, factor, unit) in CONTROLS.items():
        value = feature_value(nodes, node)
        if value is None:
            continue
        least, greatest = (_limit(nodes, node, end) for end in ("min", "max"))
        found.append(
            CameraControl(
                name,
                float(value) / factor,
                unit,
                None if least is None else least / factor,
                None if greatest is None else greatest / factor,
            )
        )
    return tuple(found)


def _limit(nodes: Any, node: str, end: str) -> float | None:
    try:
        return float(getattr(getattr(nodes, node), end))
    except Exception:  # the camera does not state the limit at present
        return None


def request_settings(nodes: Any, wish: Wish) -> tuple[str, ...]:
    """Request settings and a grey format from a camera; return a sentence for each refused setting."""
    asked: dict[str, Any] = {}
    if feature_value(nodes, "PixelFormat") not in MONO:
        asked["PixelFormat"] = next((each for each in MONO if each in _choices(nodes, "PixelFormat")), None)
    if wish.size_px is not None:
        asked["Width"], asked["Height"] = wish.size_px
    if wish.rate_hz is not None:
        asked["AcquisitionFrameRateEnable"], asked["AcquisitionFrameRate"] = True, float(wish.rate_hz)
    for name, (node, factor) in NODES.items():
        value = getattr(wish.camera, name)
        if value is not None:
            asked[node] = factor * value
    notes = []
    for node, value in asked.items():
        try:
            if value is not None:
                getattr(nodes, node).value = value
        except Exception as error:  # missing or locked feature, or value out of range
            if node != "AcquisitionFrameRateEnable":  # many cameras do not have this feature and do not need it
                notes.append(f"The camera refused the requested setting {node} = {value} ({error_words(error)}).")
            continue
    return tuple(notes)


def read_settings(nodes: Any) -> Mapping[str, str]:
    """Return the settings that the camera states, each with its unit."""
    units = {"AcquisitionFrameRate": "Hz", "ExposureTime": "us", "Gain": "dB", "PixelFormat": ""}
    found = {node: feature_value(nodes, node) for node in units}
    return {node: f"{value} {units[node]}".strip() for node, value in found.items() if value is not None}


def feature_value(nodes: Any, node: str) -> Any:
    """Return the value of a feature; None if the camera has no such feature, or does not state it now."""
    try:
        return getattr(nodes, node).value
    except Exception:
        return None


def _choices(nodes: Any, node: str) -> tuple[str, ...]:
    try:
        return tuple(getattr(nodes, node).symbolics)
    except Exception:
        return ()


def error_words(error: Exception) -> str:
    """Return class and message of an error in one line, without the final full stop."""
    return f"{type(error).__name__}: {error}".replace("\n", " ")[:200].rstrip(". :")
