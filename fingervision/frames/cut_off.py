"""Detect a video file that is truncated: shorter than its headers state."""

import av


def cut_off(
    container: av.container.InputContainer, stream: av.VideoStream, packets: int, last_end_s: float | None
) -> str | None:
    """Return a sentence if the file states more video than it contains.

    Parameters
    ----------
    container, stream : PyAV's
        PyAV's objects for file and video stream, after reading to the end.
    packets : int
        Number of packets read.
    last_end_s : float or None
        End time of the last packet.

    Returns
    -------
    str or None
        A sentence; None if the file is complete.
    """
    kind = container.format.name
    if "mp4" in kind and stream.frames > packets:
        return f"The recording is truncated here: the file states {stream.frames} frames but contains {packets}."
    stated_s = None
    if "matroska" in kind:
        stated_s = _clock_s(stream.metadata.get("DURATION")) or (
            container.duration / av.time_base if container.duration and len(container.streams) == 1 else None
        )
    elif "avi" in kind and stream.duration and stream.time_base:
        stated_s = float(stream.duration * stream.time_base)
    if stated_s is None or not stream.average_rate:
        return None
    # A difference of one and a half frames is permitted, because containers round, and state the start or the end of
    # the last frame.
    if stated_s - (last_end_s or 0.0) > 1.5 / float(stream.average_rate):
        return (
            f"The recording is truncated here: the file states {stated_s:.2f} s but contains {last_end_s or 0.0:.2f} s."
        )
    return None


def _clock_s(clock: str | None) -> float | None:
    """Convert Matroska's hours:minutes:seconds to seconds."""
    try:
        hours, minutes, seconds = (float(part) for part in (clock or "").split(":"))
    except ValueError:
        return None
    return 3600.0 * hours + 60.0 * minutes + seconds
