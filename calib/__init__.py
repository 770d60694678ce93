"""Convert pixels of any flat scene to millimetres, with uncertainty.

The public names are listed in `__all__`; each is imported when it is first used. All functions take and return numpy
arrays; pictures are grey levels of shape (height, width).

Examples
--------
Two dark bars of known width, rendered at 40 pixels per millimetre, give the scale:

>>> import numpy as np
>>> import calib
>>> def bar(width_px):
...     away = np.abs(np.arange(400) - 199.5) - 0.5 * width_px
...     row = 200.0 - 150.0 * np.clip(0.5 - away, 0.0, 1.0)
...     return np.rint(np.tile(row, (300, 1))).astype(np.uint8)
>>> known = [calib.KnownSize(f"{mm} mm", "bar", mm, 0.001, bar(40.0 * mm)) for mm in (3.0, 5.0)]
>>> fit = calib.scale_from_pictures(known)
>>> round(fit.calibration.px_per_mm, 2)
40.0
"""

import sys
from importlib import import_module
from types import ModuleType

_HOMES = {
    "Agreement": "gauge_study",
    "BareScale": "calibration",
    "Board": "board",
    "BoardCorners": "board",
    "BoardFit": "scale_from_board",
    "Budget": "budget",
    "Calibration": "measured_scale",
    "CalibrationError": "errors",
    "CameraResponse": "camera_response",
    "Distances": "measured_scale",
    "GaugeStudy": "gauge_study",
    "KnownSize": "known_widths",
    "Lens": "projection",
    "Limits": "limits",
    "LineScaleFit": "scale_from_lines",
    "MeasuredSize": "scale_from_sizes",
    "Plane": "projection",
    "Reference": "measured_scale",
    "ScaleFit": "scale_from_sizes",
    "ScaleLines": "line_scale",
    "StatedScale": "calibration",
    "find_corners": "board",
    "find_lines": "line_scale",
    "find_widths": "known_widths",
    "gauge_study": "gauge_study",
    "response_from_exposures": "measured_response",
    "scale_from_board": "scale_from_board",
    "scale_from_lines": "scale_from_lines",
    "scale_from_pictures": "scale_from_sizes",
    "scale_from_sizes": "scale_from_sizes",
    "standard_response": "camera_response",
}
"""Module of this package that defines each public name."""

__all__ = list(_HOMES)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _Package(ModuleType):
    """Package type in which a public function takes precedence over the module of the same name."""

    def __setattr__(self, name: str, value: object) -> None:
        is_own = isinstance(value, ModuleType) and _HOMES.get(name) == name
        super().__setattr__(name, getattr(value, name) if is_own else value)


sys.modules[__name__].__class__ = _Package
