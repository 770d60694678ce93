"""Contract tests of frame sources."""

from itertools import islice

import numpy as np

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.checked_frames import description_faults, held
from fingervision.frames.source import FrameSource, Wish
from fingervision.frames.source_kinds import SourceKind
from fingervision.testing.contract import ContractError, NotApplicable, hold

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

    def test_it_describes_itself(self) -> None:
        """The source has a description, each field of which is what `Description` says."""
        for must, found in description_faults(self.source().description):
            hold(False, f"The source must {must}, but {found}.")

    def test_its_frames_are_as_described(self) -> None:
        """Frames are numbered from 0, lost ones included; size, type and times are as described, and times increase."""
        self._frames(self.source())

    def test_a_recording_reads_alike_twice(self) -> None:
        """A recording that is opened again yields the same frames."""
        source = self.source()
        if not source.description.files:
            raise NotApplicable("a live source yields different frames each time")
        first, again = self._frames(source), self._frames(self.source())
        alike = len(first) == len(again) and all(map(_alike, first, again))
        hold(alike, f"{self.name} must yield the same frames when it is opened again, but does not.")

    def _frames(self, source: FrameSource) -> list[Frame | LostFrame]:
        return list(islice(held(source.description, source, _refused), LOOKED_AT))


def _refused(must: str, found: str) -> ContractError:
    return ContractError(f"The source must {must}, but {found}.")


def _alike(one: Frame | LostFrame, other: Frame | LostFrame) -> bool:
    if isinstance(one, Frame) and isinstance(other, Frame):
        return bool(np.array_equal(one.pixels, other.pixels)) and one.time_s == other.time_s
    return type(one) is type(other)
