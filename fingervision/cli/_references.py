"""References on the command line: IMAGE=SIZE_MM, slot:IMAGE=SIZE_MM."""

from collections.abc import Sequence
from pathlib import Path

from fingervision.domain.errors import UsageError

KINDS = ("bar", "slot")


def named_references(
    items: Sequence[str],
    kind: str,
    form: str = "SIZE_MM with a positive size",
    example: str = "ref5.png=5.000",
) -> list[tuple[str, Path, float]]:
    """Kind, picture and value of every item; `form` and `example` state in an error what the value must be."""
    return [_item(item, kind, form, example) for item in items]


def _item(item: str, kind: str, form: str, example: str) -> tuple[str, Path, float]:
    name, _, size = item.rpartition("=")
    prefix, colon, rest = name.partition(":")
    if colon and prefix in KINDS:
        kind, name = prefix, rest
    try:
        size_mm = float(size)
    except ValueError:
        size_mm = 0.0
    if not name or not 0.0 < size_mm < float("inf"):
        raise UsageError(
            f"A {'reference' if 'SIZE' in form else 'picture'} must be IMAGE={form}, but is {item!r}: write {example}."
        )
    return kind, Path(name), size_mm


def region_from(roi: str | None) -> tuple[int, int, int, int] | None:
    """Read X,Y,W,H.

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
