"""Determine once per recording whether the fingers are darker or lighter than the background.

If the user has not stated the polarity, the first frames decide by majority, because fingers do not change from dark to
light within a recording. The majority excludes frames in which the bright regions on either side of a dark object look
like two light fingers.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.pipeline import Settings, measure_frame

Outcome = GapMeasurement | NoGap | LostFrame

# Number of frames with a gap that decide by majority, and largest number of pixels that are stored until the decision.
VOTERS, MOST_KEPT_PX = 15, 15_000_000


def one_polarity(
    frames: Iterable[Frame | LostFrame],
    settings: Settings,
    votes: Counter[str],
    is_stopped: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[Frame | LostFrame, Outcome]]:
    """Measure frames in order, all with the polarity found in most of the first frames that have a measured gap.

    Parameters
    ----------
    frames : iterable of Frame or LostFrame
        The recording; its frames are read once, in order.
    settings : Settings
        Settings of the measurement; a polarity stated in them is kept.
    votes : Counter of str
        Counter to which the numbers of first frames with `dark` and `light` fingers are added.
    is_stopped : callable
        Called after every frame; if it returns True no more frames are read, and the frames measured so far are still
        yielded.

    Yields
    ------
    (Frame or LostFrame, GapMeasurement or NoGap or LostFrame)
        Every frame with its result. The first frames with a gap are yielded after all of them have been counted; frames
        without a gap before them are yielded at once.
    """
    source = iter(frames)
    if settings.fingers_are_dark is None:
        kept: list[tuple[Frame | LostFrame, Outcome]] = []
        pixels = 0
        for item in source:
            outcome = measure_frame(item, settings) if isinstance(item, Frame) else item
            if isinstance(outcome, GapMeasurement):
                votes["dark" if outcome.light_gap else "light"] += 1
            elif not votes:
                yield item, outcome
                if is_stopped():
                    return
                continue
            kept.append((item, outcome))
            pixels += item.pixels.size if isinstance(item, Frame) else 0
            if votes.total() >= VOTERS or pixels > MOST_KEPT_PX or is_stopped():
                break
        if votes:
            settings = replace(settings, fingers_are_dark=votes["dark"] >= votes["light"])
        for item, outcome in kept:
            is_other = isinstance(outcome, GapMeasurement) and outcome.light_gap != settings.fingers_are_dark
            yield item, measure_frame(item, settings) if is_other and isinstance(item, Frame) else outcome
    while not is_stopped():
        following = next(source, None)
        if following is None:
            return
        yield following, measure_frame(following, settings) if isinstance(following, Frame) else following
