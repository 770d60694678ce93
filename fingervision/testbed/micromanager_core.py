"""Micro-Manager's core with the devices of one configuration, shared by a stage and a camera; needs pymmcore."""

from typing import Any

from fingervision.storage.toml_section import Section
from fingervision.testbed.build_context import BuildContext

KEYS = ("folder", "configuration", "device")


class Core:
    """The core, unloaded when its last user has released it.

    Parameters
    ----------
    core : pymmcore.CMMCore
        The core with its devices.
    """

    def __init__(self, core: Any) -> None:
        self.core = core
        self.users = 0

    def release(self) -> None:
        """Unload the devices after their last use."""
        self.users -= 1
        if self.users == 0:
            self.core.unloadAllDevices()


def core_of(section: Section, context: BuildContext) -> Core:
    """Return the core with the configuration that a device's section names; it is loaded once.

    Raises
    ------
    DataError
        pymmcore is not installed, the configuration cannot be loaded, or it has no such device.
    """
    path = str(context.folder / section.word("configuration"))
    key = f"micromanager {path}"
    if key not in context.shared:
        try:
            import pymmcore
        except ImportError as error:
            section.refuse("kind", f"needs pymmcore ({error}): pip install 'fingervision[micromanager]'.")
        core = pymmcore.CMMCore()
        core.setDeviceAdapterSearchPaths([str(context.folder / section.word("folder"))])
        try:
            core.loadSystemConfiguration(path)
        except Exception as error:  # of the SWIG library
            words = " ".join(str(error).split())[:300].rstrip(".")
            section.refuse("configuration", f"must be one that Micro-Manager can load, but {path} failed ({words}).")
        context.shared[key] = Core(core)
    shared: Core = context.shared[key]
    shared.users += 1
    section.word("device", of=[each for each in shared.core.getLoadedDevices() if each != "Core"])
    return shared
