"""Notification of new pictures, with a single check of the view for all browser pages."""

import asyncio

from fingervision.live.frame_measurement import Seen
from fingervision.live.preview import draw_beforehand
from fingervision.live.view import View

# Time between two checks for a new picture, which is also the largest delay of a picture.
LOOK_EVERY_S = 0.01


class PictureWatch:
    """Encodes each new picture once, and wakes all browser pages that wait for it; used within one event loop.

    Parameters
    ----------
    view : View
        The live measurement or recording that is shown.
    """

    def __init__(self, view: View) -> None:
        self._view = view
        self._changed = asyncio.Event()
        self._waiting = 0
        self._looking: asyncio.Task[None] | None = None

    async def other_than(self, shown: Seen | None, timeout_s: float) -> None:
        """Wait until the view shows another picture than `shown`, at most for `timeout_s`.

        Parameters
        ----------
        shown : Seen or None
            Picture that the page already has; None if it has none.
        timeout_s : float
            The longest wait, in seconds.
        """
        self._waiting += 1
        try:
            async with asyncio.timeout(timeout_s):
                while self._view.seen is shown:
                    if self._looking is None:
                        self._looking = asyncio.create_task(self._look(shown))
                    await self._changed.wait()
        except TimeoutError:
            pass
        finally:
            self._waiting -= 1

    async def _look(self, last: Seen | None) -> None:
        try:
            while self._waiting:
                await asyncio.sleep(LOOK_EVERY_S)
                if self._view.seen is not last:
                    await asyncio.to_thread(draw_beforehand, self._view)
                    break
        finally:
            self._looking = None
            self._changed.set()
            self._changed = asyncio.Event()
