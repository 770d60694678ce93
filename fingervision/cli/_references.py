"""Pictures of references as the command line names them: IMAGE=SIZE_MM, slot:IMAGE=SIZE_MM."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fingervision.domain.errors import FingervisionError, UsageError

if TYPE_CHECKING:
    from calib.known_widths import KnownSize
    from fingervision.vision.grey import GreyImage

KINDS = ("bar", "slot")


def read_references(items: Sequence[str], kind: str, u_size_mm: float) -> list["KnownSize"]:
    """Read every picture and its size.

    Raises
    ------
    UsageError
        An item is not IMAGE=SIZE_MM, or a picture is named twice.
    FingervisionError
        A picture cannot be read, or is of another size.
    """
    from calib.known_widths import KnownSize

    named = named_references(items, kind)
    pictures = read_pictures([path for _, path, _ in named])
    return [
        KnownSize(path.name, which, size_mm, u_size_mm, grey)
        for (which, path, size_mm), grey in zip(named, pictures, strict=True)
    ]


def named_references(
    items: Sequence[str],
    kind: str,
    form: str = "SIZE_MM with a positive size",
    example: str = "ref5.png=5.000",
) -> list[tuple[str, Path, float]]:
    """Kind, picture and value of every item; `form` and `example` say in a sentence what the value must be."""
    return [_item(item, kind, form, example) for item in items]


def read_pictures(paths: Sequence[Path]) -> list["GreyImage"]:
    """Read pictures as grey levels; all of one size, none twice."""
    from fingervision.frames.image_file import UnreadableImageError, read_image
    from fingervision.vision.grey import to_grey

    seen: dict[Path, Path] = {}
    for path in paths:
        twin = seen.setdefault(path.resolve(), path)
        if twin is not path:
            raise UsageError(f"Every picture may be named once, but {path} is named twice: leave one out.")
    pictures: list[GreyImage] = []
    for path in paths:
        if not path.exists():
            raise FingervisionError(f"There is no picture {path}; check the name.")
        try:
            pictures.append(to_grey(read_image(path)))
        except UnreadableImageError as error:
            raise FingervisionError(f"The picture {path} cannot be used: {error}") from error
        if pictures[-1].shape != pictures[0].shape:
            (height, width), (first_height, first_width) = pictures[-1].shape, pictures[0].shape
            raise FingervisionError(
                f"All pictures must be of one size, but {path.name} is {width}x{height} and {paths[0].name} is "
                f"{first_width}x{first_height}: take all of them with the camera set alike."
            )
    return pictures


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
        It is not four whole numbers.
    """
    if roi is None:
        return None
    try:
        x, y, width, height = (int(part) for part in roi.split(","))
    except ValueError:
        raise UsageError(f"--roi must be X,Y,W,H in whole pixels, but is {roi!r}.") from None
    return x, y, width, height
