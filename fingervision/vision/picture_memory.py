"""Setting of the C library to keep the memory of intermediate pictures for the next frame."""

from functools import cache

from fingervision.domain.loops import loop

# Intermediate pictures of 3840 x 2160 pixels have 8 MB each, and a few of them exist at the same time.
KEPT_BYTES = 2**25

_keep = loop("picture_memory_keep")


@cache
def keep_picture_memory() -> bool:
    """Let this process keep freed memory of up to `KEPT_BYTES` for later pictures.

    The GNU C library returns the memory of a large picture to the system as soon as it is freed, and the system clears
    every page that it gives out anew: for pictures of 3840 x 2160 pixels, clearing the pages takes as long as the
    measurement.

    Returns
    -------
    bool
        Whether the C library has this setting; other C libraries remain unchanged.
    """
    return bool(_keep(KEPT_BYTES))
