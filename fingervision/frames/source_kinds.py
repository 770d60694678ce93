"""The kinds of frame sources, built in and from elsewhere, and the search for a source by its name."""

import importlib
import logging
import pkgutil
from functools import cache, partial
from pathlib import Path
from typing import Protocol, cast

import fingervision.frames
from fingervision.domain.errors import FingervisionError, InputFileError, UsageError, error_words
from fingervision.frames.checked_frames import CheckedFrames
from fingervision.frames.source import FrameSource, Wish
from fingervision.plugins.faults import MisfitError, PluginShapeError
from fingervision.plugins.origin import Entry
from fingervision.plugins.registry import Registry

LOG = logging.getLogger(__name__)


class SourceKind(Protocol):
    """Protocol of a kind of frame source: a module, or another object, that opens sources by name."""

    def accepts(self, name: str) -> bool:
        """Whether a name belongs to this kind of source.

        The function `accepts` is called for every recording, so that it must be fast and must not open anything.
        """
        ...

    def open_frames(self, name: str, wish: Wish) -> FrameSource:
        """Open the source; raise FingervisionError with a sentence if that is impossible."""
        ...


def open_source(name: str, wish: Wish | None = None) -> FrameSource:
    """Open a recording or camera by its name.

    Every module of this package that has `accepts(name) -> bool` and `open_frames(name, wish) -> FrameSource` is a kind
    of source, as is every module or object with these two functions in another distribution (entry points of the group
    `fingervision.frame_sources`). A kind with `TAKES_THE_REST = True` is tried only if no other kind accepts the name.

    Raises
    ------
    DataError, DeviceError, InputFileError
        If no kind of source accepts the name, or the kind that does cannot read it.
    UsageError
        If several kinds accept the name.
    """
    return _opened(kind_of(name), name, wish or Wish())


def kind_of(name: str) -> Entry[SourceKind]:
    """Find the kind of source that opens a name, without opening it; `open_source` says what is refused."""
    if not name:
        raise UsageError("The recording must have a name, but it is empty: give a file, a folder, or a glob in quotes.")
    if Path(name).exists() and not (Path(name).is_file() or Path(name).is_dir() or name.startswith("/dev/")):
        raise InputFileError(f"{name} must be a file or a folder, but is a pipe or a device: save it as a file first.")
    claims = [entry for entry in REGISTRY.entries() if _accepts(entry, name)]
    claims = [entry for entry in claims if not getattr(entry.value, "TAKES_THE_REST", False)] or claims
    if len(claims) > 1:
        who = " and ".join(f"{entry.name} ({entry.origin})" for entry in claims)
        raise UsageError(
            f"Only one kind of source may accept {name}, but {who} accept it: rename the recording, or remove one of "
            "these kinds of source."
        )
    if not claims:
        raise InputFileError(
            f"There is no recording {name}: give a video file, a folder of images, or a glob in quotes."
        )
    return claims[0]


def _accepts(entry: Entry[SourceKind], name: str) -> bool:
    if entry.origin.built_in:
        return entry.value.accepts(name)
    try:
        return bool(entry.value.accepts(name))
    except Exception as error:  # an error in one kind of source must not affect the others
        LOG.warning("fingervision: The frame source %s of %s cannot be used (%r).", entry.name, entry.origin, error)
        return False


def _opened(entry: Entry[SourceKind], name: str, wish: Wish) -> FrameSource:
    if entry.origin.built_in:
        return entry.value.open_frames(name, wish)
    who = f"The frame source {entry.name} of {entry.origin}"
    try:
        source = entry.value.open_frames(name, wish)
        described = hasattr(source, "description") and hasattr(source, "__iter__")
    except FingervisionError:
        raise
    except Exception as error:
        raise PluginShapeError(f"{who} could not open {name} ({error_words(error)}): {entry.origin.remedy}.") from error
    if not described:
        raise PluginShapeError(
            f"{who} must return a frame source (an iterable object with a Description), but returned a "
            f"{type(source).__name__}: {entry.origin.remedy}."
        )
    refused = partial(_refused, f"{entry.name} of {entry.origin}", entry.origin.remedy)
    return CheckedFrames(source, wish.rate_hz, refused, is_plugin=True)


def _refused(who: str, remedy: str, must: str, found: str) -> PluginShapeError:
    return PluginShapeError(f"The frame source {who} must {must}, but {found}: {remedy}.")


@cache
def _built_in() -> tuple[str, ...]:
    names = (module.name for module in pkgutil.iter_modules(fingervision.frames.__path__))
    return tuple(name for name in names if hasattr(_load(name), "accepts"))


def _load(name: str) -> SourceKind:
    return cast("SourceKind", importlib.import_module(f"{fingervision.frames.__name__}.{name}"))


def _held(held: object) -> dict[str, SourceKind]:
    lacks = [name for name in ("accepts", "open_frames") if not callable(getattr(held, name, None))]
    if lacks:
        raise MisfitError(f"must have accepts(name) and open_frames(name, wish), but has no {' and no '.join(lacks)}")
    return {"": cast("SourceKind", held)}


REGISTRY: Registry[SourceKind] = Registry("fingervision.frame_sources", "frame source", _built_in, _load, _held)
