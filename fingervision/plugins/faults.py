"""Error classes of plug-ins; each message names the plug-in and states what to do."""

from fingervision.domain.errors import FingervisionError


class PluginError(FingervisionError):
    """A plug-in cannot be used; all other plug-ins and parts can still be used."""


class PluginImportError(PluginError):
    """A plug-in raised an exception while it was imported."""


class PluginTimeoutError(PluginError):
    """A plug-in did not finish its import or trial within the time limit."""


class PluginShapeError(PluginError):
    """A plug-in does not meet the requirements of its group: wrong type, missing method, or array of wrong shape."""


class PluginNameError(PluginError):
    """The name of a plug-in is already taken."""


class PluginVersionError(PluginError):
    """A plug-in needs another version of fingervision than the installed version."""


class MisfitError(PluginShapeError):
    """The cause of a PluginShapeError; its message `must ..., but ...` does not name the plug-in yet."""
