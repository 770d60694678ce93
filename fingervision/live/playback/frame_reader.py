"""Access to single frames of a recording by number, which never returns a different frame."""

from collections import OrderedDict
from collections.abc import Callable, Iterator

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.seeking import Seeking, seeking

# Memory for pictures that are stored for stepping back.
KEPT_BYTES = 64_000_000
# A frame at most this far ahead is reached by reading on, which is faster than seeking.
NEAR_FRAMES = 12

Item = Frame | LostFrame


class FrameReader:
    """Reads frames of a recording in any order.

    A frame is accessed by its time if the table of the recording states this time and the source allows random access;
    otherwise the recording is read from its beginning and frames are counted, as `measure` does.

    Parameters
    ----------
    begin : callable
        Function that starts reading the recording from its beginning.
    name : str
        Name of the recording.
    are_files : bool
        Whether every frame is a file of its own. A lost frame is then read again at each access, because a file that
        was missing may be there again.
    """

    def __init__(self, begin: Callable[[], Iterator[Item]], name: str, *, are_files: bool = False) -> None:
        self._begin = begin
        self._are_files = are_files
        self._items = begin()
        self._following = 0
        self._kept: OrderedDict[int, Item] = OrderedDict()
        self._seeking: Seeking | None = seeking(name)

    def at(self, index: int, time_s: float | None) -> Item | None:
        """Return the frame with a given number in the recording.

        Parameters
        ----------
        index : int
            Number of the frame, from 0.
        time_s : float or None
            Time of the frame, if the time is known and no neighbouring frame has the same time; otherwise None.

        Returns
        -------
        Frame, LostFrame or None
            The frame; None beyond the end of the recording.

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
        if self._are_files and isinstance(item, LostFrame):
            return
        self._kept[item.index] = item
        size = sum(each.pixels.nbytes for each in self._kept.values() if isinstance(each, Frame))
        while size > KEPT_BYTES and len(self._kept) > 1:
            _, oldest = self._kept.popitem(last=False)
            size -= oldest.pixels.nbytes if isinstance(oldest, Frame) else 0
