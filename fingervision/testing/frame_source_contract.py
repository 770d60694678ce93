"""Contract tests of frame sources."""

from itertools import islice, pairwise

import numpy as np

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import Description, FrameSource, SourceKind, Wish
from fingervision.testing.contract import NotApplicable, hold

LOOKED_AT = 8
"""Number of frames that are tested, because a live source has no end."""
NOWHERE = ("nowhere/nothing.xyz", "no such recording")


class FrameSourceContract:
    """Contract tests of one kind of frame source, stated as `kind`, with a recording that it can open (`name`)."""

    kind: SourceKind
    name: str
    wish: Wish = Wish()

    def source(self) -> FrameSource:
        """Open the recording."""
        return self.kind.open_frames(self.name, self.wish)

    def test_it_knows_what_it_is_and_what_it_is_not(self) -> None:
        """The kind accepts its own recording, and does not accept a missing file."""
        hold(bool(self.kind.accepts(self.name)), f"The source must accept {self.name}, but does not.")
        for name in NOWHERE:
            hold(not self.kind.accepts(name), f"The source must not accept {name!r}, which does not exist, but does.")

    def test_it_describes_its_frames(self) -> None:
        """The description agrees with the frames that the source yields."""
        source = self.source()
        described = source.description
        hold(
            isinstance(described, Description),
            f"The source must have a Description, but has a {type(described).__name__}.",
        )
        for frame in self._frames(source):
            if isinstance(frame, Frame):
                size = frame.width_px, frame.height_px
                hold(
                    size == (described.width_px, described.height_px),
                    f"Every frame must be {described.width_px} x {described.height_px} px, as described, but frame "
                    f"{frame.index} is {size[0]} x {size[1]} px.",
                )
                hold(
                    (frame.time_s is not None) == described.has_times,
                    f"Frames must {'' if described.has_times else 'not '}have times, as described, but frame "
                    f"{frame.index} has {'none' if frame.time_s is None else 'one'}.",
                )

    def test_frames_come_in_order(self) -> None:
        """Frame numbers, including those of lost frames, are consecutive from 0, and times increase."""
        frames = self._frames(self.source())
        indices = [frame.index for frame in frames]
        hold(indices == list(range(len(frames))), f"Frame numbers must be consecutive from 0, but are {indices}.")
        times = [frame.time_s for frame in frames if isinstance(frame, Frame) and frame.time_s is not None]
        hold(all(a < b for a, b in pairwise(times)), f"Times of frames must increase, but are {times}.")

    def test_pixels_are_grey_levels_or_colours(self) -> None:
        """Pixels have 8 or 16 bits, and one or three channels."""
        for frame in self._frames(self.source()):
            if isinstance(frame, Frame):
                pixels = frame.pixels
                hold(
                    pixels.dtype.name in ("uint8", "uint16") and (pixels.ndim == 2 or pixels.shape[2:] == (3,)),
                    "Pixels must be uint8 or uint16 of shape (height, width) or (height, width, 3), but are "
                    f"{pixels.dtype} of shape {pixels.shape}.",
                )

    def test_a_recording_reads_alike_twice(self) -> None:
        """A recording that is opened again yields the same frames."""
        source = self.source()
        if not source.description.files:
            raise NotApplicable("a live source yields different frames each time")
        first, again = self._frames(source), self._frames(self.source())
        alike = len(first) == len(again) and all(
            type(a) is type(b)
            and (not isinstance(a, Frame) or not isinstance(b, Frame) or (a.pixels == b.pixels).all())
            for a, b in zip(first, again, strict=False)
        )
        hold(alike, f"{self.name} must yield the same frames when it is opened again, but does not.")

    def _frames(self, source: FrameSource) -> list[Frame | LostFrame]:
        frames = list(islice(source, LOOKED_AT))
        hold(bool(frames), f"{self.name} must have at least one frame, but has none.")
        return frames


def _alike(one: Frame | LostFrame, other: Frame | LostFrame) -> bool:
    if isinstance(one, Frame) and isinstance(other, Frame):
        return bool(np.array_equal(one.pixels, other.pixels)) and one.time_s == other.time_s
    return type(one) is type(other)
