"""Versions of a worker's software, and a hash of the source code."""

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import calib
import fingervision

LIBRARIES = ("numpy", "scipy", "opencv-python-headless", "scikit-image", "av", "matplotlib")


@cache
def versions() -> dict[str, str]:
    """Versions of the installed software, by name."""
    found = {"Python": ".".join(platform.python_version_tuple()[:2]), "fingervision": fingervision.__version__}
    for library in LIBRARIES:
        try:
            found[library] = version(library)
        except PackageNotFoundError:
            found[library] = "not installed"
    return {**found, "source of fingervision": _source()}


def difference(here: dict[str, str], there: dict[str, str]) -> str:
    """Describe the differences between two sets of versions; empty if they are equal."""
    return ", ".join(
        f"{name} {there.get(name, 'unknown')} instead of {here[name]}" for name in here if there.get(name) != here[name]
    )


def _source() -> str:
    """Hash of all Python and C sources of both packages, because two copies of the same version may still differ."""
    found = hashlib.sha256()
    for package in (fingervision, calib):
        top = Path(str(package.__file__)).parent
        for file in sorted(path for kind in ("*.py", "*.c", "*.h") for path in top.rglob(kind)):
            found.update(f"{file.relative_to(top).as_posix()}\0".encode())
            found.update(file.read_bytes())
    return found.hexdigest()[:12]
