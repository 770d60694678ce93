"""Read one frame of a recording by its number, as fast as the recording allows, and never a wrong one."""

from collections import OrderedDict
from collections.abc import Callable, Iterator

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.seeking import Seeking, seeking

# Pictures that are kept for stepping back.
KEPT_BYTES = 64_000_000
# From here a frame is read on to rather than sought.
NEAR_FRAMES = 12

Item = Frame | LostFrame


class FrameReader:
    """Reads frames in any order.

    A frame is accessed by its time if the recording's table states it and the source allows random access; otherwise
    the recording is read from its beginning and counted, as `measure` does.

    Parameters
    ----------
    begin : callable
        Begins to read the recording anew.
    name : str
        The recording.
    """

    def __init__(self, begin: Callable[[], Iterator[Item]], name: str) -> None:
        self._begin = begin
        self._items = begin()
        self._following = 0
        self._kept: OrderedDict[int, Item] = OrderedDict()
        self._seeking: Seeking | None = seeking(name)

    def at(self, index: int, time_s: float | None) -> Item | None:
        """Frame with a given number.

        Parameters
        ----------
        index : int
            From 0.
        time_s : float or None
            Its time, where it is known and no other frame has it.

        Returns
        -------
        Frame, LostFrame or None
            None beyond the recording's end.

        Raises
        ------
        FingervisionError
            The recording cannot be read any more.
        """
        if index in self._kept:
            self._kept.move_to_end(index)
            return self._kept[index]
        is_near = self._following <= index < self._following + NEAR_FRAMES
        if not is_near and self._seeking is not None and time_s is not None:
            found = self._seeking.frame(index, time_s)
            if found is not None:
                self._keep(found)
                return found
        return self._counted(index)

    def _counted(self, index: int) -> Item | None:
        if index < self._following:
            self._items, self._following = self._begin(), 0
        for item in self._items:
            self._following = item.index + 1
            self._keep(item)
            if item.index == index:
                return item
        self._items, self._following = self._begin(), 0
        return None

    def _keep(self, item: Item) -> None:
        self._kept[item.index] = item
        size = sum(each.pixels.nbytes for each in self._kept.values() if isinstance(each, Frame))
        while size > KEPT_BYTES and len(self._kept) > 1:
            _, oldest = self._kept.popitem(last=False)
            size -= oldest.pixels.nbytes if isinstance(oldest, Frame) else 0
