"""Import of a module from a file that the user named."""

import hashlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from fingervision.plugins.faults import PluginFileError, PluginVersionError
from fingervision.plugins.origin import Origin, of_file
from fingervision.plugins.requirements import stated_in, unmet

SUFFIX = ".py"


def check_file(path: Path, what: str) -> Origin:
    """Refuse a file that cannot be imported, before any of its code runs.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        Expected content for the error message, such as `effects` or `an actuator`.

    Raises
    ------
    PluginFileError
        The file does not exist, or is not a Python file.
    PluginVersionError
        The inline metadata of the file require another version of fingervision.
    """
    origin = of_file(str(path))
    if not path.exists():
        raise PluginFileError(f"There is no file {path}: {what} must come from a Python file that exists.")
    if not path.is_file() or path.suffix.lower() != SUFFIX:
        raise PluginFileError(
            f"{what.capitalize()} must come from a Python file (NAME.py), but {path} is not a Python file: name one."
        )
    try:
        source = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise PluginFileError(f"{path} must be a Python file in UTF-8, but could not be read ({error}).") from error
    missing = unmet(stated_in(source))
    if missing is not None:
        raise PluginVersionError(needs(str(path), missing))
    return origin


def needs(who: str, specifier: str) -> str:
    """Return the error for a plug-in that needs another version of fingervision."""
    from fingervision import __version__

    return (
        f"{who} needs fingervision {specifier}, but the installed version is {__version__}: install the required "
        "version."
    )


def load_file(path: Path) -> ModuleType:
    """Import a file under a unique module name, so that two files of the same name do not collide.

    A file whose content has changed is imported again.
    """
    whole = path.resolve()
    digest = hashlib.sha256(f"{whole}\n".encode() + whole.read_bytes()).hexdigest()[:16]
    name = f"_fingervision_file_{digest}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, whole)
    assert spec is not None  # noqa: S101 - a file NAME.py always has one
    assert spec.loader is not None  # noqa: S101 - as above
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look up their module during its import
    try:
        spec.loader.exec_module(module)
    except BaseException:
        sys.modules.pop(name, None)
        raise
    return module
