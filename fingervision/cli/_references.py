"""Reference objects on the command line, in the form IMAGE=SIZE_MM or slot:IMAGE=SIZE_MM."""

from collections.abc import Sequence
from pathlib import Path

from fingervision.domain.errors import ArgumentError, UsageError
from fingervision.domain.numbers import stated_number

KINDS = ("bar", "slot")


def named_references(
    items: Sequence[str],
    kind: str,
    form: str = "SIZE_MM with a positive size",
    example: str = "ref5.png=5.000",
) -> list[tuple[str, Path, float]]:
    """Read kind, picture and size of every reference object; an error states the form that each item must have."""
    return [_item(item, kind, form, example) for item in items]


def _item(item: str, kind: str, form: str, example: str) -> tuple[str, Path, float]:
    name, _, size = item.rpartition("=")
    prefix, colon, rest = name.partition(":")
    if colon and prefix in KINDS:
        kind, name = prefix, rest
    try:
        size_mm = stated_number(size, f"The size in {item}")
    except ArgumentError as error:
        if "," in size:
            raise UsageError(str(error)) from None
        size_mm = 0.0
    if not name or not 0.0 < size_mm < float("inf"):
        raise UsageError(
            f"A {'reference' if 'SIZE' in form else 'picture'} must be IMAGE={form}, but is {item!r}: write {example}."
        )
    return kind, Path(name), size_mm


def region_from(roi: str | None) -> tuple[int, int, int, int] | None:
    """Read a region of interest in the form X,Y,W,H (pixels).

    Raises
    ------
    UsageError
        The region is not four whole numbers.
    """
    if roi is None:
        return None
    try:
        x, y, width, height = (int(part) for part in roi.split(","))
    except ValueError:
        raise UsageError(f"--roi must be four whole numbers X,Y,W,H in pixels, but is {roi!r}.") from None
    return x, y, width, height
