"""A decoded picture: its luma plane as the decoder stored it, and the codec's quantiser steps over it.

FFmpeg reports the quantiser on request (`export_side_data=venc_params`, libavutil/video_enc_params.h) for H.264, VP9
and the MPEG family up to MPEG-4 part 2; for other codecs it is unknown.
"""

import struct
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import av
import numpy as np
from av.sidedata.sidedata import SideDataContainer
from numpy.typing import NDArray

from fingervision.domain.frame import Pixels
from fingervision.domain.loops import loop
from fingervision.domain.quantiser import BLOCK_PX, Quantiser

# Option of the decoder that exports the quantiser steps.
EXPORTED = {"export_side_data": "venc_params"}
SIDE_DATA = "VIDEO_ENC_PARAMS"
# Values of the enumeration AVVideoEncParamsType.
VP9, H264, MPEG = 0, 1, 2
# ITU-T H.264 (2021), 8.5.9: at 8 bits, the step is 1 at a quantisation parameter of 4, and doubles when the parameter
# increases by 6.
H264_UNIT, H264_DOUBLES = 4.0, 6.0
# libvpx, vp9_quant_common.c: the first steps are 4 and 8, for a transform of gain 8; further steps grow by 1 or by this
# factor, whichever is more.
VP9_LOSSLESS, VP9_FIRST, VP9_GROWTH, VP9_GAIN, VP9_COUNT = 4.0, 8, 1.01975, 8.0, 256
# ISO/IEC 14496-2, 7.4.4: coefficients are multiples of twice the quantiser, which is what FFmpeg states.
# Factor by which the range of differences that a codec rounds to zero, relative to its step, exceeds that of H.264. The
# MPEG family rounds differences below 1.25 steps to zero (H.263's quantiser), H.264 those below 0.6 to 0.8, and VP9
# about as H.264. Measured with `python -m tests.benchmarks.compressed_video --only mpeg4-1-upright vp9-1-upright
# vp9-4-upright`.
MPEG_LEAVES, VP9_LEAVES = 2.0, 1.0
# Limits of the quantisation parameter in any codec with 8 to 14 bits; a damaged stream may have values beyond the
# limits.
LEAST_PARAMETER, MOST_PARAMETER = -128, 511
# Size of a block's entry: five numbers of four bytes (libavutil/video_enc_params.h, AVVideoBlockParams).
BLOCK_BYTES = 20
# Factor by which the step of an earlier picture decreases with every later picture. A block that is not coded again
# keeps the error of the picture in which it was last coded, but filters and predictions in later pictures reduce the
# error.
FADES = 0.97

_fill = loop("quantiser_steps_fill")
_side_data: Any = SideDataContainer  # PyAV's types do not know that it takes a picture


def _vp9_steps() -> NDArray[np.float64]:
    found = [VP9_FIRST]
    while len(found) < VP9_COUNT - 1:
        found.append(max(int(found[-1] * VP9_GROWTH), found[-1] + 1))
    return np.array([VP9_LOSSLESS, *found]) / VP9_GAIN


VP9_STEPS = _vp9_steps()


class StatedSteps(NamedTuple):
    """Quantiser steps of one picture, on the scale of H.264.

    Parameters
    ----------
    quantiser : Quantiser
        The steps.
    kind : int
        Kind of codec (a value of FFmpeg's AVVideoEncParamsType).
    """

    quantiser: Quantiser
    kind: int


def stated_steps(picture: av.VideoFrame) -> StatedSteps | None:
    """Quantiser steps of a decoded picture; None if its codec does not report them.

    Parameters
    ----------
    picture : av.VideoFrame
        Picture that was decoded with `EXPORTED` among the decoder's options.
    """
    # Up to PyAV 18, a picture keeps its `picture.side_data`, which keeps the picture: decoded pictures would stay in
    # memory until Python's collector finds the cycle. The picture does not know of a container that is made here.
    found = _side_data(picture).get(SIDE_DATA)
    if found is None:
        return None
    data = bytes(found)
    count, blocks_at, size, kind, base = struct.unpack_from("@IxxxxQQii", data)
    shape = (-(-picture.height // BLOCK_PX), -(-picture.width // BLOCK_PX))
    if kind == VP9 and not count:  # one step for the whole picture, unless it has segments
        step = VP9_LEAVES * VP9_STEPS[min(max(base, 0), VP9_COUNT - 1)]
        return StatedSteps(Quantiser(np.full(shape, step, dtype=np.float32)), kind)
    if not count or kind not in (H264, MPEG):
        return None
    if size < BLOCK_BYTES or blocks_at + count * size > len(data):
        return None
    step = np.empty(shape, dtype=np.float32)
    _fill(data, blocks_at, size, count, base, _steps(kind, picture.format.components[0].bits), step)
    return StatedSteps(Quantiser(step), kind)


@cache
def _steps(kind: int, bits: int) -> NDArray[np.float32]:
    """Step for every parameter from `LEAST_PARAMETER` to `MOST_PARAMETER`, on the scale of 8 bits."""
    parameter = np.arange(LEAST_PARAMETER, MOST_PARAMETER + 1, dtype=np.float32)
    if kind == H264:
        return np.asarray(2.0 ** ((parameter - H264_UNIT) / H264_DOUBLES) / 2.0 ** (bits - 8), dtype=np.float32)
    return np.asarray(MPEG_LEAVES * parameter, dtype=np.float32)


@dataclass(slots=True, eq=False)
class StepTrail:
    """Quantiser steps of a stream's pictures, including the steps of earlier pictures from which blocks are copied.

    A block that is copied from an earlier picture (skipped) has no step of its own, but inherits the step of the
    preceding block (QP_Y,PRED in ITU-T H.264 (2021), 7.4.5). The preceding block is often flat background with a step
    up to four times finer. The content of a skipped block was coded in an earlier picture. The step of every block is
    therefore the largest step since the last key frame, reduced by a factor (`FADES`) for every later picture.

    VP9 states one step for the whole picture, by which its encoder decides for every block whether the difference from
    the copied block is coded; then no earlier step counts.
    """

    last: NDArray[np.float32] | None = None

    def of(self, picture: av.VideoFrame) -> Quantiser | None:
        """Quantiser steps of the next picture of the stream; None if its codec does not report them."""
        stated = stated_steps(picture)
        if stated is None:
            self.last = None
            return None
        found, kind = stated
        if kind == VP9 or picture.key_frame or self.last is None or self.last.shape != found.step.shape:
            self.last = found.step
            return found
        self.last = np.maximum(found.step, np.float32(FADES) * self.last)
        return Quantiser(self.last)


# The luma plane of a decoded picture, as the decoder stored it.

# Packed formats: number of elements from the luma of one pixel to that of the next pixel, and position of the first
# luma element.
PACKED = {"yuyv422": (2, 0), "yvyu422": (2, 0), "uyvy422": (2, 1), "ya8": (2, 0), "ya16le": (2, 0), "ya16be": (2, 0)}
# Beginnings of the names of formats whose first plane is luma, with one element per pixel.
PLANAR = ("yuv4", "yuva4", "yuvj4", "gray", "nv1", "nv2", "nv4", "p0", "p2", "p4", "y8")


def luma(picture: av.VideoFrame) -> Pixels:
    """Grey levels of a picture, or its colours if it has no luma plane.

    Nothing is converted: 8-bit luma is returned as the decoder's own memory. Luma of 9 to 15 bits is scaled to 16 bits,
    so that its largest level becomes 65535.

    Parameters
    ----------
    picture : av.VideoFrame
        The decoded picture.

    Returns
    -------
    ndarray of uint8 or uint16, shape (height, width) or (height, width, 3)
        Luma; red, green and blue if the codec stores these.
    """
    name = picture.format.name
    bits = picture.format.components[0].bits
    step, first = PACKED.get(name, (1, 0))
    if "f32" in name or "f16" in name or bits > 16 or not (name in PACKED or name.startswith(PLANAR)):
        return _colours(picture, bits)
    plane = picture.planes[0]
    memory: Any = plane
    if bits <= 8:
        rows: NDArray[np.uint8] = np.frombuffer(memory, np.uint8).reshape(-1, plane.line_size)
        return rows[: picture.height, first : picture.width * step : step]
    wide = np.frombuffer(memory, ">u2" if name.endswith("be") else "<u2").reshape(-1, plane.line_size // 2)
    levels: NDArray[np.uint16] = wide[: picture.height, first : picture.width * step : step].astype(np.uint16)
    if bits == 16:
        return levels
    if name.startswith(("p0", "p2", "p4")):
        levels = levels >> np.uint16(16 - bits)
    # The upper bits are repeated in the free lower bits, so that level 0 stays 0 and the largest level becomes 65535.
    return (levels << np.uint16(16 - bits)) | (levels >> np.uint16(2 * bits - 16))


def _colours(picture: av.VideoFrame, bits: int) -> Pixels:
    """Red, green and blue of a picture stored in an RGB format, without loss."""
    grey = picture.format.name.startswith(("mono", "gray"))
    wanted = ("gray16le" if bits > 8 else "gray") if grey else ("rgb48le" if bits > 8 else "rgb24")
    levels: Any = picture.to_ndarray(format=wanted)
    pixels: Pixels = levels
    return pixels
