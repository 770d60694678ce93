"""A second recording beside a recording: its picture and its gap at the same time, and the difference of both."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace
from math import hypot
from typing import Any

from fingervision.live.choices import Choices
from fingervision.live.playback.playback import USUAL_RATE_HZ, Playback
from fingervision.live.playback.recorded import Recorded, recorded
from fingervision.storage.gaps_csv import GapRow

SECOND = "second"
# Longest time between two frames between which a gap is interpolated, in periods of the frame rate.
MOST_PERIODS = 2.5


class SecondRecording(Playback):
    """Plays a recording in step with another, the first, and compares the gaps of both.

    Parameters
    ----------
    opened : Recorded
        The second recording with its measurement settings.
    first : Playback
        The recording that leads.
    has_own_settings : bool
        Whether the second recording is a run that is measured with its own settings; otherwise, changes of the first
        recording's settings hold for both.
    """

    def __init__(self, opened: Recorded, first: Playback, *, has_own_settings: bool) -> None:
        super().__init__(opened, first.out)
        self._first, self.has_own_settings = first, has_own_settings
        self.offset_s = 0.0
        """Time that is added to the times of the second recording."""
        self.on_message.append(lambda message: first.say(message.name, f"Beside: {message.words}"))
        self.on_table = lambda rows: first.renew()
        if not has_own_settings:
            first.companions.append(self)
        first.features[SECOND] = self
        first.on_stop.append(self.stop)

    def shift(self, offset_s: float) -> None:
        """Add a time (s) to the times of the second recording, instead of the time that was added before."""
        self.offset_s = offset_s
        self._first.renew()

    def differences(self, rows: Sequence[GapRow]) -> list[tuple[float, float] | None]:
        """Gap of the second recording at the time of each row of the first.

        Parameters
        ----------
        rows : sequence of GapRow
            Rows of the first recording.

        Returns
        -------
        list of (float, float) or None
            Gap of the second recording (mm) and standard uncertainty of the difference of both gaps (mm); None where
            the second recording has no gap, or the first.
        """
        return [self._difference(row) for row in rows]

    def described(self) -> dict[str, Any]:
        """Return the state of the second recording, for the browser page."""
        row = None if self.seen is None else self.seen.row
        scale = self.choices.scale
        return {
            "source": self.description.name,
            "offset_s": self.offset_s,
            "frame": None if row is None else row.frame,
            "time_s": None if row is None else row.time_s,
            "gap_mm": None if row is None else row.gap_mm,
            "status": None if row is None else row.status.value,
            "measured": self.row_count,
            "frames": self.frame_count,
            "own_settings": self.has_own_settings,
            "px_per_mm": None if scale is None else scale.px_per_mm,
            "trouble": self.supervisor.trouble,
        }

    def _advance(self) -> None:
        self.frame = self.frame_at(self._first.time_s - self.offset_s)

    def _difference(self, row: GapRow) -> tuple[float, float] | None:
        if row.gap_mm is None or row.u_random_mm is None:
            return None
        time_s = row.frame / (self._first.description.rate_hz or USUAL_RATE_HZ) if row.time_s is None else row.time_s
        found = self._gap_at(time_s - self.offset_s)
        if found is None:
            return None
        gap_mm, u_mm, beside = found
        difference_mm = row.gap_mm - gap_mm
        return gap_mm, hypot(u_mm, *self._systematic_mm(row, beside, difference_mm))

    def _systematic_mm(self, row: GapRow, beside: GapRow, difference_mm: float) -> list[float]:
        """Parts of the uncertainty of a difference that is not from the second's noise.

        What both recordings share cancels: of one scale, only its relative uncertainty of the difference remains, while
        two scales are unsure each for itself. The picture's own systematic part may differ from recording to recording.
        """
        parts = [row.u_random_mm or 0.0]
        scales = [view.choices.scale for view in (self._first, self)]
        for each, scale in zip((row, beside), scales, strict=True):
            if each.u_shift_px is not None and scale is not None:
                parts.append(each.u_shift_px / scale.px_per_mm)
        known = [(scale.px_per_mm, getattr(scale, "u_px_per_mm", 0.0) or 0.0) for scale in scales if scale is not None]
        if known[:1] == known[1:]:
            px_per_mm, u_px_per_mm = known[0]
            return [*parts, difference_mm * u_px_per_mm / px_per_mm]
        return [*parts, *(each.u_gap_mm or 0.0 for each in (row, beside))]

    def _gap_at(self, time_s: float) -> tuple[float, float, GapRow] | None:
        """Gap at a time (mm), its random uncertainty with that of interpolating (mm), and the nearest row."""
        after = bisect_left(range(self.row_count), time_s, key=self._time_of)
        last = self._row(after)
        if last is not None and self._time_of(after) - time_s < 1e-6 and last.gap_mm is not None:
            return last.gap_mm, last.u_random_mm or 0.0, last
        rows = [self._row(number) for number in range(after - 2, after + 2)]
        before, last = rows[1:3]
        if before is None or last is None or before.gap_mm is None or last.gap_mm is None:
            return None
        begin_s, end_s = self._time_of(after - 1), self._time_of(after)
        if end_s - begin_s > MOST_PERIODS / (self.description.rate_hz or USUAL_RATE_HZ):
            return None
        share = (time_s - begin_s) / (end_s - begin_s)
        gaps_mm = [None if each is None else each.gap_mm for each in rows]
        bends_mm = [
            one - 2.0 * two + three
            for one, two, three in zip(gaps_mm, gaps_mm[1:], gaps_mm[2:], strict=False)
            if one is not None and two is not None and three is not None
        ]
        # A chord is off by this half of the second difference: unsure by all of it.
        chord_mm = 0.5 * share * (1.0 - share) * max(map(abs, bends_mm), default=0.0)
        u_mm = hypot((1.0 - share) * (before.u_random_mm or 0.0), share * (last.u_random_mm or 0.0), chord_mm)
        return (1.0 - share) * before.gap_mm + share * last.gap_mm, u_mm, last if share > 0.5 else before


def beside_recording(name: str, rate_hz: float | None, choices: Choices, first: Playback) -> SecondRecording:
    """Open a recording or a run folder beside another.

    Parameters
    ----------
    name : str
        The second recording.
    rate_hz : float or None
        Frame rate of images without times.
    choices : Choices
        Settings chosen by the user; without a scale, those of the second recording's run apply, or else those of the
        first recording.
    first : Playback
        The first recording.

    Raises
    ------
    DataError, InputFileError, UsageError
        The recording cannot be opened, or the settings do not fit its frames.
    """
    opened = recorded(name, rate_hz, choices, ())
    is_run = opened.choices is not choices
    if not is_run:
        opened = replace(opened, choices=first.choices)
    return SecondRecording(opened, first, has_own_settings=is_run)
