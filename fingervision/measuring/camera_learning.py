"""First pass over a recording: learn its camera from the first frames with a gap, then give these frames back."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from calib.calibration import is_stated
from calib.measured_scale import Calibration
from fingervision.domain.camera import CameraModel, Origin
from fingervision.domain.frame import Coding, Frame, LostFrame
from fingervision.domain.one_thread import one_thread
from fingervision.domain.own_process import in_own_process
from fingervision.measuring.scale import Scale
from fingervision.measuring.temporal_filter import temporal_lag
from fingervision.vision.defect_pixels import defect_pixels
from fingervision.vision.flank_profiles import Seen
from fingervision.vision.gap import specimen_roughness
from fingervision.vision.grey import to_grey, top_level
from fingervision.vision.learnt_camera import learnt_camera
from fingervision.vision.learnt_scene import learnt_beside, less_sure
from fingervision.vision.pipeline import Settings, steps_alone
from fingervision.vision.single_picture import beside_in

# Number of frames with a gap from which the camera is learnt: five show all sub-pixel positions of slightly tilted
# flanks, twelve average their noise. Fewest frames; most frames that are read for them, and pixels that are kept.
WANTED, FEWEST, MOST_READ, MOST_KEPT_PX = 12, 3, 60, 15_000_000

Learn = Callable[[Sequence[Frame], Settings, Scale | None], CameraModel]


def learnt_first(
    frames: Iterable[Frame | LostFrame],
    settings: Settings,
    scale: Scale | None,
    is_stopped: Callable[[], bool] = lambda: False,
    learn: Learn | None = None,
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
    learn : callable or None
        What learns the camera from these frames, if not `camera_of`.

    Returns
    -------
    frames : iterator of Frame or LostFrame
        All frames in order; an exception of the source is raised after the frames that came before it.
    camera : CameraModel
        The learnt camera, with the response before if that is known; the camera before if too few frames have a gap.
    """
    source = iter(frames)
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
    return chain(kept, _raised(failed), source), (learn or camera_of)(seen, settings, scale)


def camera_beside(frames: Sequence[Frame], settings: Settings, scale: Scale | None) -> CameraModel:
    """`camera_of` in a process of its own, so that the threads of this one go on: the fits take seconds in Python."""
    return in_own_process(camera_of, frames, settings, scale)


def camera_of(frames: Sequence[Frame], settings: Settings, scale: Scale | None) -> CameraModel:
    """Camera as frames of one recording show it; the camera before if too few of them have a gap."""
    with one_thread():
        return _camera_of(frames, settings, scale)


def _camera_of(frames: Sequence[Frame], settings: Settings, scale: Scale | None) -> CameraModel:
    settings = replace(settings, camera=_with_defects(settings.camera, frames, settings.bits))
    before = settings.camera
    looks = [(frame, look) for frame in frames if (look := steps_alone(frame, settings)) is not None]
    if not looks:
        return before
    seen = [each for _, (each, _, _) in looks]
    first, polarities = looks[0][0], {is_dark for _, (_, is_dark, _) in looks}
    are_dark = polarities == {True}
    coding, top = first.coding, max(top_level(to_grey(frame.pixels), settings.bits) for frame, _ in looks)
    if len(looks) < FEWEST:  # too few phases and too much noise for a tone curve
        return replace(before, beside=beside_in(frames, settings))
    rough = specimen_roughness([(fingers, edges) for _, ((_, edges), _, fingers) in looks], settings.below_tip_px)
    camera = replace(learnt_camera(seen, before, top, coding, are_dark=are_dark), roughness=rough)
    if coding is not Coding.INTERFRAME:  # such a codec repeats the noise of the picture before
        lag = temporal_lag([(frame.index, *each) for frame, (each, _, _) in looks])
        camera = replace(camera, lag=lag)
    if _has_edge_bias(scale):
        camera = replace(camera, response=before.response, beside=None)
    is_other = before.response.is_known or camera.response.curve is not before.response.curve
    if is_other:
        # The steps of light lie elsewhere under another response.
        again = replace(settings, camera=camera)
        seen = [look[0] for frame, _ in looks if (look := steps_alone(frame, again)) is not None]
        if 2 * len(seen) < len(looks):  # a response under which most of these frames show no gap is not theirs
            return replace(before, roughness=rough)
    if polarities == {False} or (are_dark and is_other):
        beside = learnt_beside(seen, camera.response, top, coding, are_dark=are_dark)
        rivals_px = camera.beside.u_gap_px if camera.beside is not None and not camera.beside.name else 0.0
        camera = replace(camera, beside=less_sure(beside, rivals_px))
    return replace(camera, usual=_usual(seen))


def _usual(seen: Sequence[Seen]) -> tuple[tuple[float, float], ...]:
    shown = np.array([(edges.unexplained, edges.widened) for _, edges in seen])
    return tuple(zip(np.median(shown, axis=0).tolist(), np.std(shown, axis=0).tolist(), strict=True))


def _with_defects(camera: CameraModel, frames: Sequence[Frame], bits: int | None) -> CameraModel:
    """Camera with the defect pixels that stand still in some frames; the camera before if there are too few frames."""
    if len(frames) < FEWEST or len({frame.pixels.shape for frame in frames}) > 1:
        return camera
    pictures = [to_grey(frame.pixels) for frame in frames]
    found = defect_pixels(pictures, max(top_level(picture, bits) for picture in pictures))
    return replace(camera, defects=found, defects_origin=Origin.LEARNT)


def _has_edge_bias(scale: Scale | None) -> bool:
    """Whether the scale was calibrated in pictures, so that its edge bias holds for the response of these pictures."""
    return isinstance(scale, Calibration) and not is_stated(scale)


def _raised(errors: Sequence[Exception]) -> Iterator[Frame]:
    for error in errors:
        raise error
    yield from ()
