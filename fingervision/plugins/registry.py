"""Registry of parts of one kind: built-in modules, entry points of other distributions, files, the present session.

Built-in parts are the modules of a package. Any other part is imported when it is first requested, under a time limit,
and checked. A part that cannot be used is omitted and reported with a sentence, and does not affect other parts.
"""

import hashlib
import importlib.util
import logging
import re
import sys
import threading
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Generic, TypeVar

from fingervision import __version__
from fingervision.domain.errors import UsageError
from fingervision.plugins.faults import (
    PluginError,
    PluginNameError,
    PluginShapeError,
    PluginVersionError,
)
from fingervision.plugins.origin import BUILT_IN, SESSION, Entry, Origin, Refusal, of_distribution, of_file
from fingervision.plugins.watched_import import importing, watched

# Required versions of fingervision, stated by a plug-in's distribution or by inline script metadata (PEP 723).


# Regular expression for the metadata block, as given in PEP 723.
SCRIPT = re.compile(r"(?m)^# /// script\s*$\s(?P<content>(?:^#(?:| .*)$\s)+?)^# ///\s*$")


def unmet(requires: Iterable[str]) -> str | None:
    """Return the first stated requirement that this version of fingervision does not meet, such as `>=0.9`.

    The function returns None if all requirements are met.

    Parameters
    ----------
    requires : iterable of str
        Requirements as in PEP 508 (`fingervision>=0.2`); requirements on other distributions and invalid requirements
        are ignored here.
    """
    from packaging.requirements import InvalidRequirement, Requirement

    for words in requires:
        if not words.lower().lstrip().startswith("fingervision"):
            continue
        try:
            asked = Requirement(words)
        except InvalidRequirement:
            continue
        applies = asked.marker is None or asked.marker.evaluate({"extra": ""})
        if asked.name.lower() != "fingervision" or not applies:
            continue
        if not asked.specifier.contains(__version__, prereleases=True):
            return str(asked.specifier)
    return None


def stated_in(source: str) -> tuple[str, ...]:
    """Read the requirements in a file's inline script metadata; empty if there are none or they are not valid TOML."""
    found = SCRIPT.search(source)
    if found is None:
        return ()
    lines = (line[2:] if line.startswith("# ") else line[1:] for line in found["content"].splitlines())
    try:
        stated = tomllib.loads("\n".join(lines)).get("dependencies", [])
    except tomllib.TOMLDecodeError:
        return ()
    return tuple(one for one in stated if isinstance(one, str)) if isinstance(stated, list) else ()


# Import of a module from a file that the user named.

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
    UsageError
        The file does not exist, or is not a Python file.
    PluginVersionError
        The inline metadata of the file require another version of fingervision.
    """
    origin = of_file(str(path))
    if not path.exists():
        raise UsageError(f"There is no file {path}: {what} must come from a Python file that exists.")
    if not path.is_file() or path.suffix.lower() != SUFFIX:
        raise UsageError(
            f"{what.capitalize()} must come from a Python file (NAME.py), but {path} is not a Python file: name one."
        )
    try:
        source = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} must be a Python file in UTF-8, but could not be read ({error}).") from error
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


T = TypeVar("T")
LOG = logging.getLogger("fingervision.plugins")


class Registry(Generic[T]):
    """The parts of one kind (such as all effects), built in or from plug-ins.

    Parameters
    ----------
    group : str
        Group of entry points: `fingervision.effects`.
    noun : str
        Word for a part of this kind in messages, such as `effect`.
    built_in : callable
        Function that returns the names of the built-in parts, in order, without importing them.
    load : callable
        Function that imports a built-in part by its name.
    parts_of : callable
        Function that returns the parts in an imported object or module by name, in order; it raises MisfitError if the
        requirements of the group are not met, and runs within the time limit. A part without a name is returned under
        the empty name, and is then known by the name under which it is registered.
    """

    def __init__(
        self,
        group: str,
        noun: str,
        built_in: Callable[[], tuple[str, ...]],
        load: Callable[[str], T],
        parts_of: Callable[[object], dict[str, T]],
    ) -> None:
        self.group, self.noun = group, noun
        self._built_in, self._load, self._parts_of = built_in, load, parts_of
        self._added: list[Entry[T]] = []
        self._lock = threading.RLock()
        self.forget()

    def forget(self) -> None:
        """Search for installed plug-ins again at the next request."""
        self._loaded: dict[str, Entry[T]] = {}
        self._refused: dict[tuple[str, str], Refusal] = {}
        self._points: tuple[EntryPoint, ...] | None = None
        self._version = getattr(self, "_version", 0) + 1

    @property
    def version(self) -> int:
        """Counter that increases whenever the parts may have changed."""
        return self._version

    def names(self) -> tuple[str, ...]:
        """List the names of all built-in, installed and added parts, without an import."""
        found = dict.fromkeys(
            (*self._built_in(), *(p.name for p in self._entry_points()), *(e.name for e in self._added))
        )
        return tuple(name for name in found if not any(name == refused for refused, _ in self._refused))

    def get(self, name: str) -> Entry[T]:
        """Return one part by its name; no other part is imported.

        Raises
        ------
        PluginError
            The part is a plug-in that cannot be used.
        KeyError
            No part has that name.
        """
        for entry in self._added:
            if entry.name == name:
                return entry
        if name in self._built_in():
            return self._loaded.setdefault(name, Entry(name, self._load(name), BUILT_IN))
        points = self._points_of(name)
        if not points:
            raise KeyError(name)
        found = self._of_points(points)
        if found is None:
            raise PluginError(next(r.sentence for (asked, _), r in self._refused.items() if asked == name))
        return found

    def entries(self) -> tuple[Entry[T], ...]:
        """Import all built-in, installed and added parts, and return those that can be used."""
        own = [self.get(name) for name in self._built_in()]
        if importing():
            return tuple(own)
        with self._lock:
            installed = [
                self._of_points([p for p in self._entry_points() if p.name == name]) for name in self._installed()
            ]
        return (*own, *(entry for entry in installed if entry is not None), *self._added)

    def refusals(self) -> tuple[Refusal, ...]:
        """Import all installed plug-ins, and list those that cannot be used, each with the reason."""
        self.entries()
        return tuple(self._refused.values())

    def add(self, name: str, value: T, origin: Origin = SESSION) -> None:
        """Add a plug-in for this Python process; a plug-in of the same name that was added before is replaced.

        Raises
        ------
        PluginNameError
            The name is that of a built-in or installed part, or of one from a file.
        """
        with self._lock:
            mine = [e for e in self._added if e.name == name]
            if any(e.value is value for e in mine):
                return
            if name in self._built_in() or any(e.origin is not SESSION or origin is not SESSION for e in mine):
                taken = BUILT_IN if name in self._built_in() else mine[0].origin
                raise PluginNameError(self._taken(name, origin, taken))
            if name in self._installed():
                raise PluginNameError(self._taken(name, origin, self._of_point(name)))
            self._added = [*(e for e in self._added if e.name != name), Entry(name, value, origin)]
            self._version += 1

    def checked(self, held: object, who: str, origin: Origin) -> dict[str, T]:
        """Return the parts that an object holds, by name, after checking them.

        Parameters
        ----------
        held : object
            A part, or a module that contains parts.
        who : str
            Beginning of an error message, which names the object.
        origin : Origin
            Origin of the object.

        Raises
        ------
        PluginError
            The object does not meet the requirements of its entry-point group.
        """
        return watched(who, origin, lambda: self._parts_of(held))

    def remove(self, name: str) -> None:
        """Remove an added part; nothing happens if no part of that name was added."""
        self._added = [entry for entry in self._added if entry.name != name]
        self._version += 1

    def in_file(self, path: Path) -> dict[str, T]:
        """Import a file and return its parts, by name.

        Raises
        ------
        PluginError, UsageError
            The file cannot be read or imported, or defines no part of this kind.
        """
        origin = check_file(path, f"{self.noun}s")
        found = watched(f"{path}", origin, lambda: self._parts_of(load_file(path)))
        if not found:
            raise UsageError(
                f"{path} must hold at least one {self.noun}, but holds none: define one as the manual's "
                "page `Extend it` shows."
            )
        return found

    @contextmanager
    def with_files(self, paths: tuple[Path, ...]) -> Iterator[None]:
        """Add the parts defined in files for the duration of a `with` block."""
        before = list(self._added)
        try:
            for path in {
                path.resolve(): path for path in reversed(paths)
            }.values():  # a file that is named twice is read once
                for name, value in self.in_file(path).items():
                    self.add(name, value, check_file(path, self.noun))
            yield
        finally:
            self._added = before
            self._version += 1

    def _entry_points(self) -> tuple[EntryPoint, ...]:
        if self._points is None:
            self._points = tuple(entry_points(group=self.group))
        return self._points

    def _points_of(self, name: str) -> list[EntryPoint]:
        return [point for point in self._entry_points() if point.name == name]

    def _installed(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(point.name for point in self._entry_points()))

    def _of_point(self, name: str) -> Origin:
        return _origin(self._points_of(name)[0])

    def _of_points(self, points: list[EntryPoint]) -> Entry[T] | None:
        """Return the part to which the entry points with one name refer; None if it cannot be used."""
        name = points[0].name
        if name in self._loaded and not self._loaded[name].origin.built_in:
            return self._loaded[name]
        for point in points:
            if (name, str(_origin(point))) in self._refused:
                continue
            others = [_origin(other) for other in points if other is not point]
            try:
                if name in self._built_in():
                    raise PluginNameError(self._taken(name, _origin(point), BUILT_IN))
                if others:
                    raise PluginNameError(self._taken(name, _origin(point), others[0]))
                self._loaded[name] = Entry(name, self._import(point), _origin(point))
            except PluginError as error:
                self._refused[name, str(_origin(point))] = Refusal(name, _origin(point), str(error))
                LOG.warning("fingervision: %s", error)
        entry = self._loaded.get(name)
        return None if entry is None or entry.origin.built_in else entry

    def _import(self, point: EntryPoint) -> T:
        origin = _origin(point)
        who = f"The {self.noun} {point.name} of {origin}"
        missing = unmet(point.dist.requires or ()) if point.dist is not None else None
        if missing is not None:
            raise PluginVersionError(needs(who, missing))
        found = watched(who, origin, lambda: self._parts_of(point.load()))
        if "" in found:
            return found[""]
        if point.name not in found:
            named = f"is named {' and '.join(found)}" if found else f"holds no {self.noun}"
            raise PluginShapeError(
                f"{who} must have the name under which it is registered, but {named}: {origin.remedy}."
            )
        return found[point.name]

    def _taken(self, name: str, origin: Origin, by: Origin) -> str:
        whose = f"a built-in {self.noun}" if by.built_in else f"one of {by}"
        return (
            f"The {self.noun} {name} of {origin} must have a name of its own, but {name} is {whose}: {origin.remedy}."
        )


def _origin(point: EntryPoint) -> Origin:
    if point.dist is None:
        return Origin("an unknown distribution", "find out which")
    return of_distribution(point.dist.metadata["Name"], point.dist.version)
