"""Measure a compliant gripper's finger gap in video, and explain where simulation and measurement disagree.

The public names stand in `__all__`. Each is imported when it is first asked for, so that `import fingervision` takes
milliseconds::

    import fingervision as fv

    measured = fv.measure("opening.mp4", calibration="calibration.json", drive="drive.csv")
    found = fv.diagnose(measured, "simulation.csv")
    print(found.report.sentence)

A public name stays for at least two minor versions after the version that says, by a `DeprecationWarning` and in the
changelog, what replaces it. What is not in `__all__`, of this package or of `calib`, may change with any version.
"""

from importlib import import_module

__version__ = "0.2.0"

_HOMES = {
    "Batch": "batch.run",
    "Calibration": "interface.calibration",
    "Changes": "interface.healthy_reference",
    "Coding": "domain.frame",
    "Comparison": "interface.comparison",
    "Description": "frames.source",
    "Diagnosis": "interface.diagnosis",
    "Frame": "domain.frame",
    "FrameSource": "frames.source",
    "Inspection": "interface.inspection",
    "LostFrame": "domain.frame",
    "Measurement": "interface.measurement",
    "OpenBed": "interface.bed",
    "Parameter": "domain.parameter",
    "Prediction": "interface.prediction",
    "RunDone": "testbed.run.recipe_run",
    "Simulation": "interface.simulation",
    "Status": "domain.status",
    "bed": "interface.bed",
    "calibrate": "interface.calibrate",
    "changes_since": "interface.healthy_reference",
    "compare": "interface.comparison",
    "diagnose": "interface.diagnosis",
    "effect": "interface.own_effect",
    "example": "interface.examples",
    "inspect": "interface.inspection",
    "measure": "interface.measure",
    "model": "interface.prediction",
    "read_model": "interface.tables",
    "read_table": "interface.tables",
    "simulate": "interface.simulation",
    "FingervisionError": "domain.errors",
    "UsageError": "domain.errors",
    "ArgumentError": "domain.errors",
    "ArgumentTypeError": "domain.errors",
    "DataError": "domain.errors",
    "EffectAnswerError": "effects.trial",
    "OpenQuestionError": "tables.questions",
    "OutputError": "domain.errors",
    "MisfitError": "plugins.faults",
    "PluginError": "plugins.faults",
    "PluginImportError": "plugins.faults",
    "PluginNameError": "plugins.faults",
    "PluginShapeError": "plugins.faults",
    "PluginTimeoutError": "plugins.faults",
    "PluginVersionError": "plugins.faults",
    "DeviceError": "domain.errors",
    "InputFileError": "domain.errors",
    "InstallationError": "domain.errors",
    "LimitError": "domain.errors",
    "MissingLibraryError": "domain.errors",
    "ModelError": "domain.errors",
    "NoCalibrationError": "domain.errors",
    "ProcessError": "domain.errors",
    "StateError": "domain.errors",
    "UnknownNameError": "domain.errors",
}
"""Where each public name lives, below this package; `batch` and `effects` are the sub-packages themselves."""

__all__ = ["__version__", "batch", "effects", *_HOMES]


def __getattr__(name: str) -> object:
    if name in ("batch", "effects"):
        return import_module(f"{__name__}.{name}")
    if name not in _HOMES:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message, name=name, obj=import_module(__name__))
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
