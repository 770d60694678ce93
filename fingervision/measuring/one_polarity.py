"""Decide once per recording whether the fingers are darker or lighter than the background.

Where the user has not stated it, the first frames decide by majority. A finger does not change its tone within a
recording. A frame in which the bright regions left and right of a dark object look like two light fingers is no
measurement of the fingers.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.pipeline import Settings, measure_frame

Outcome = GapMeasurement | NoGap | LostFrame

# So many frames with a number vote, and no more than so many pixels are kept until they have.
VOTERS, MOST_KEPT_PX = 15, 15_000_000


def one_polarity(
    frames: Iterable[Frame | LostFrame],
    settings: Settings,
    votes: Counter[str],
    is_stopped: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[Frame | LostFrame, Outcome]]:
    """Measure frames in order, all with the polarity of most of the first frames that have a number.

    Parameters
    ----------
    frames : iterable of Frame or LostFrame
        The recording; read once.
    settings : Settings
        Where they state the polarity, it stays.
    votes : Counter of str
        Takes in how many of the first frames show `dark` and `light` fingers.
    is_stopped : callable
        Asked after every frame; when it says so no more frames are read, and what was measured is still handed over.

    Yields
    ------
    (Frame or LostFrame, GapMeasurement or NoGap or LostFrame)
        Every frame with what it says. The first ones come once they have voted; until a frame has a number, those
        without one come at once.
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
