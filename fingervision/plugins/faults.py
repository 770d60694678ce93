"""Error classes of plug-ins; each message names the plug-in and says what to do."""

from fingervision.domain.errors import FingervisionError, UsageError


class PluginError(FingervisionError):
    """A plug-in cannot be used; all other plug-ins and parts still can."""


class PluginImportError(PluginError):
    """A plug-in raised an exception while it was imported."""


class PluginTimeoutError(PluginError):
    """A plug-in did not finish its import or trial within the time limit."""


class PluginShapeError(PluginError):
    """A plug-in is not what its group requires: another type, a missing method, or an array of another shape."""


class PluginNameError(PluginError):
    """The name of a plug-in is already taken."""


class PluginVersionError(PluginError):
    """A plug-in needs another version of fingervision than this one."""


class MisfitError(ValueError):
    """The second part of a sentence that begins with a plug-in's name: `must ..., but ...`, without a full stop."""


class PluginFileError(UsageError):
    """The plug-in file does not exist, or holds nothing that can be plugged in."""
