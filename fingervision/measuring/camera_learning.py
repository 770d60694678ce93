"""First pass over a recording: learn its camera from the first frames with a gap, then give these frames back."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain

from calib.calibration import is_stated
from calib.measured_scale import Calibration
from fingervision.domain.camera import CameraModel
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.gap import GapMeasurement
from fingervision.measuring.scale import Scale
from fingervision.measuring.temporal_filter import temporal_lag
from fingervision.vision.flank_profiles import Seen
from fingervision.vision.grey import to_grey, top_level
from fingervision.vision.learnt_camera import learnt_camera
from fingervision.vision.pipeline import Settings, look_closely, region_of_interest

# Number of frames with a gap from which the camera is learnt: five show all sub-pixel positions of slightly tilted
# flanks, twelve average their noise. Fewest frames; most frames that are read for them, and pixels that are kept.
WANTED, FEWEST, MOST_READ, MOST_KEPT_PX = 12, 3, 60, 15_000_000


def learnt_first(
    frames: Iterable[Frame | LostFrame],
    settings: Settings,
    scale: Scale | None,
    is_stopped: Callable[[], bool] = lambda: False,
) -> tuple[Iterator[Frame | LostFrame], CameraModel]:
    """Learn the camera from the first frames.

    Parameters
    ----------
    frames : iterable of Frame or LostFrame
        The recording; its frames are read once, in order.
    settings : Settings
        Settings of the measurement, with the camera before.
    scale : Scale or None
        Conversion to millimetres; the edge bias of a calibration holds for the response with which it was made.
    is_stopped : callable
        Called after every frame; if it returns True no more frames are read for the camera.

    Returns
    -------
    frames : iterator of Frame or LostFrame
        All frames in order; an exception of the source is raised after the frames that came before it.
    camera : CameraModel
        The learnt camera; the camera before if its response is known or too few frames have a gap.
    """
    source = iter(frames)
    if settings.camera.response.is_known:
        return source, settings.camera
    kept: list[Frame | LostFrame] = []
    seen: list[Frame] = []
    failed: list[Exception] = []
    pixels = 0
    while len(seen) < WANTED and len(kept) < MOST_READ and not is_stopped():
        if pixels > MOST_KEPT_PX and len(seen) >= FEWEST:
            break
        try:
            item = next(source, None)
        except Exception as error:
            failed.append(error)
            break
        if item is None:
            break
        if isinstance(item, Frame):
            # The pixels are copied, because the decoder may use its memory again for the next picture.
            item = replace(item, pixels=item.pixels.copy())
            pixels += item.pixels.size
            seen.append(item)
        kept.append(item)
    return chain(kept, _raised(failed), source), camera_of(seen, settings, scale)


def camera_of(frames: Sequence[Frame], settings: Settings, scale: Scale | None) -> CameraModel:
    """Camera as frames of one recording show it; the camera before if too few of them have a gap."""
    seen: list[Seen] = []
    numbers: list[int] = []
    coding, top = Coding.LOSSLESS, 0
    for frame in frames:
        outcome, fingers, edges = look_closely(frame, settings)
        if isinstance(outcome, GapMeasurement) and fingers is not None and edges is not None:
            grey = region_of_interest(to_grey(frame.pixels), settings.region)
            seen.append((fingers.orientation.view(grey), edges))
            numbers.append(frame.index)
            coding, top = frame.coding, max(top, top_level(grey, settings.bits))
    before = settings.camera
    if len(seen) < FEWEST:
        return before
    camera = learnt_camera(seen, before, top, coding)
    if coding is not Coding.INTERFRAME:  # such a codec repeats the noise of the picture before
        lag = temporal_lag([(number, *each) for number, each in zip(numbers, seen, strict=True)])
        camera = replace(camera, lag=lag)
    return replace(camera, response=before.response) if _has_edge_bias(scale) else camera


def _has_edge_bias(scale: Scale | None) -> bool:
    """Whether the scale was calibrated in pictures, so that its edge bias holds for the response of these pictures."""
    return isinstance(scale, Calibration) and not is_stated(scale)


def _raised(errors: Sequence[Exception]) -> Iterator[Frame]:
    for error in errors:
        raise error
    yield from ()
