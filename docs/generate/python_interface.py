"""The reference of the Python interface: every public name, from its docstring."""

import importlib
import inspect
from types import ModuleType

import calib
import fingervision

FOR_AUTHORS = {
    "fingervision.testbed.actuator": ("Actuator", "MoveCheck", "StageLimits", "Alarm"),
    "fingervision.storage.toml_section": ("Section",),
    "fingervision.testbed.build_context": ("BuildContext",),
    "fingervision.testbed.clocks.clock": ("Clock",),
    "fingervision.testbed.motion.soft_limits": ("SoftLimits",),
    "fingervision.testbed.reading": ("Reading",),
    "fingervision.testbed.motion.move_limits": ("check_move", "check_speed"),
    "fingervision.testbed.camera": ("BedCamera", "Shot", "Latency"),
    "fingervision.testbed.force_sensor": ("ForceSensor",),
    "fingervision.domain.effect": ("DriveEffect", "PointEffect", "History", "Stage"),
    "fingervision.domain.response": ("Response",),
    "fingervision.domain.drawing_form": ("DrawingForm",),
}
"""What the author of a device or an effect imports beside `fingervision` itself, by module."""


def python_page() -> str:
    """Write a section for each package, and in it an entry for each public name."""
    testing = importlib.import_module("fingervision.testing")
    sections = (_section(fingervision, "fingervision"), _section(calib, "calib"), _for_authors(), _section(testing))
    return "\n\n".join(sections) + "\n"


def _section(module: ModuleType, title: str = "fingervision.testing, the contract tests") -> str:
    names = [name for name in module.__all__ if not name.startswith("__")]
    entries = "\n\n".join(_entry(module, name) for name in names)
    return f"## Every name of {title}\n\n```{{eval-rst}}\n{entries}\n```"


def _for_authors() -> str:
    entries = [_entry(importlib.import_module(path), name) for path, names in FOR_AUTHORS.items() for name in names]
    return "## For authors of devices and effects\n\n```{eval-rst}\n" + "\n\n".join(entries) + "\n```"


def _entry(module: ModuleType, name: str) -> str:
    thing = getattr(module, name)
    path = f"{module.__name__}.{name}"
    if inspect.isclass(thing):
        kind = "autoexception" if issubclass(thing, Exception) else "autoclass"
        # What a protocol takes over from another one is asked of a device as well.
        taken_over = "\n   :inherited-members: Protocol" if getattr(thing, "_is_protocol", False) else ""
        return f".. {kind}:: {path}\n   :members:{taken_over}"
    if inspect.isfunction(thing):
        return f".. autofunction:: {path}"
    # What is no class and no function has the docstring of its type.
    words = " ".join((inspect.getdoc(type(thing)) or "").split("\n\n")[0].split())
    return f".. py:data:: {path}\n\n   {words}"
