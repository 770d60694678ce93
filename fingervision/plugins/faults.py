"""Error classes of plug-ins; each message names the plug-in and what to do."""

from fingervision.domain.errors import FingervisionError, UsageError


class PluginError(FingervisionError):
    """A plug-in cannot be used; everything else can."""


class PluginImportError(PluginError):
    """It raised an exception while it was imported."""


class PluginTimeoutError(PluginError):
    """It was still being imported or tried when its time was up."""


class PluginShapeError(PluginError):
    """It is not what its group asks for: another type, a missing method, an array of another shape."""


class PluginNameError(PluginError):
    """Its name is taken."""


class PluginVersionError(PluginError):
    """It needs another version of fingervision than this one."""


class MisfitError(ValueError):
    """The rest of a sentence that begins with a plug-in: `must ..., but ...`, without a point at its end."""


class PluginFileError(UsageError):
    """There is no such file, or it holds nothing that can be plugged in."""
