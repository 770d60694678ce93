"""The summary of a measurement: counts, lengths, uncertainties, and what the uncertainties do not include."""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calib.calibration import is_stated
from calib.measured_scale import Calibration
from fingervision import __version__
from fingervision.domain.camera import BesideEdges, CameraQuantity, Origin
from fingervision.domain.errors import InputFileError
from fingervision.domain.status import Status
from fingervision.frames.source import Description
from fingervision.measuring.light_change import light_change
from fingervision.measuring.scale import Scale, field_of_view
from fingervision.measuring.series import GapSeries

# Coverage factor k of the expanded uncertainty U = k u (JCGM 100:2008, 6.2), for a coverage of about 95 %.
COVERAGE_FACTOR = 2
LOSSLESS_ADVICE = (
    "The recording is compressed with loss ({codec}): its errors are several times those of the camera's noise, and "
    "are correlated between pixels and between frames. Record losslessly (FFV1 or raw) if a hundredth of a pixel "
    "matters."
)
NO_LIMITS = (
    "The calibration {name} has no limits (key budget.limits): u_gap_mm does not include the fingers' distance from "
    "the plane of the reference, tilt, lens distortion and temperature. Calibrate with "
    "`fingervision calibrate`, or add the limits of the set-up."
)
# Advice for each disturbance of the edges: what was found, how it is treated, and how to remove it.
BESIDE = {
    "wall": "the side wall of a thick part is visible beside the edge; --face states which edge is measured, and "
    "u_shift_px includes the distance of edges that cannot be distinguished. A lens of longer focal length, light "
    "from behind or a mask over the wall removes the disturbance.",
    "shadow": "a soft shadow lies beside the edges; its effect is corrected, and u_shift_px includes the uncertainty "
    "of the correction. Light from behind, or from both sides, removes the shadow.",
    "glare": "a bright line lies along the edges; its effect is corrected, and u_shift_px includes the possibility "
    "that the line is a bevel. Diffuse light, or light from behind, removes the line.",
    "motion": "the fingers move while the shutter is open; u_shift_px includes the possible shift at round tips. A "
    "shorter exposure reduces the motion.",
    "sharpening": "the camera sharpens its pictures; the shift of the edges is corrected, and u_shift_px includes the "
    "uncertainty of the correction. Switch sharpening off in the camera's settings.",
    "trail": "a trail follows the moving fingers, as from temporal noise reduction in the camera, which mixes earlier "
    "pictures into each picture; u_shift_px includes the distance by which the edges may lag. Switch noise reduction "
    "off in the camera's settings, or move more slowly.",
    "roughness": "the edges deviate from a mean line by more than their noise (roughness, printing, texture, or a "
    "lossy codec); the mean line is measured, and the uncertainty includes the scatter. A rough finger makes contact "
    "by its peaks, which lie farther outside.",
    "interlaced": "even and odd rows were exposed at different times (interlaced video); the gap is the mean of both. "
    "Record progressive video.",
}
BYTES_AT_ONCE = 1 << 20
LEAST_BITS_A_PIXEL = 0.05
"""Bits per pixel below which compression may hide the fingers: H.264 at 1 Mbit/s of 640x480 at 25 Hz has 0.13 and can
be measured (tests/benchmarks/accuracy.py); at 0.4 Mbit/s it has 0.05."""
HIDDEN_BY_COMPRESSION = (
    Status.NO_FINGERS,
    Status.ONE_FINGER,
    Status.TIP_OUT_OF_VIEW,
    Status.LOW_CONTRAST,
    Status.BLURRED,
)


def summarise(
    description: Description,
    settings: Mapping[str, Any],
    scale: Scale,
    scale_file: Path | None,
    series: GapSeries,
    *,
    complete: bool,
) -> dict[str, Any]:
    """Compose the content of summary.json.

    Parameters
    ----------
    description : Description
        The recording.
    settings : mapping
        Settings of the user.
    scale : Scale
        Conversion from pixels to millimetres.
    scale_file : Path or None
        Path from which the scale was read.
    series : GapSeries
        The gap over time.
    complete : bool
        Whether the recording was measured to its end.

    Returns
    -------
    dict
        Content that JSON can represent; None for unknown values.
    """
    first = series.first_damaged
    return {
        "software": {"name": "fingervision", "version": __version__},
        "made_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "complete": complete,
        "recording": {
            "name": description.name,
            "kind": description.kind,
            "codec": description.codec,
            "lossy": description.lossy,
            "width_px": description.width_px,
            "height_px": description.height_px,
            "rate_hz": description.rate_hz,
            "sha256": _sha256(description.files),
        },
        "settings": dict(settings),
        "scale": _scale(scale, scale_file),
        "frames": series.frames,
        "counts": {status.value: series.counts[status] for status in Status},
        "fingers": dict(series.fingers),
        "beside_edges": dict(series.beside),
        "first_damaged": None if first is None else asdict(first),
        "why": {
            status.value: {"first_frame": found.frame, "words": found.words}
            for status, found in series.first_without.items()
        },
        "gap": _statistics(series),
        "camera": _camera(series),
        "uncertainty": {**_uncertainty(scale, settings), "parts": series.budget},
        "advice": [
            *_about_scale(description, settings, scale),
            *_about_unseen(description, series),
            *([LOSSLESS_ADVICE.format(codec=description.codec)] if description.lossy else []),
            *_about_fingers(series),
            *_about_light(series),
            *about_edges(series),
            *([NO_LIMITS.format(name=scale_file or "given")] if _states_no_limits(scale) else []),
            *description.notes,
        ],
    }


def _camera(series: GapSeries) -> dict[str, Any]:
    """What is known about the camera: each property with its value, standard uncertainty and origin."""
    camera, response_px = series.camera, series.response_px

    def quantity(of: CameraQuantity, unit: str) -> dict[str, Any]:
        return {"value": of.value, "u": of.u, "unit": unit, "origin": of.origin.value}

    spread, noise = camera.point_spread, camera.noise
    unknown = {"value": None, "u": None, "origin": Origin.ASSUMED.value}
    return {
        "response": {
            "value": camera.response.curve.name,
            "u": float(np.median(response_px)) if response_px.size else None,
            "unit": "px of the gap",
            "origin": camera.response.origin.value,
            "words": camera.response.words,
        },
        "point_spread": unknown
        if spread is None
        else {
            **quantity(spread.sigma_px, "px"),
            "disc_radius_px": spread.disc_radius_px,
            "tail_shares": list(spread.tail_shares),
            "tail_px": spread.tail_px,
        },
        "noise": unknown
        if noise is None
        else {
            **quantity(noise.dark_variance, "full scale squared"),
            "per_light": quantity(noise.variance_per_light, "full scale squared per light"),
        },
        "sharpening": quantity(camera.sharpening, "share of the contrast"),
        "lag": quantity(camera.lag, "frames"),
        "defects": {
            "value": [asdict(defect) for defect in camera.defects],
            "u": None,
            "origin": camera.defects_origin.value,
        },
        "beside_edges": None if camera.beside is None else _beside(camera.beside),
    }


def _states_no_limits(scale: Scale) -> bool:
    return isinstance(scale, Calibration) and scale.states_no_limits


def _about_scale(description: Description, settings: Mapping[str, Any], scale: Scale) -> list[str]:
    """Warning if the measuring height is less than a pixel, as where the scale is stated in another unit."""
    below_px = settings["below_tip_mm"] * scale.px_per_mm
    if below_px >= 1.0 or settings["fingers"] == "none":
        return []
    shown = field_of_view((description.width_px, description.height_px), scale.px_per_mm)
    return [
        f"The gap is measured {settings['below_tip_mm']:g} mm below the tips, which is {below_px:.2g} px at "
        f"{scale.px_per_mm:.4g} px/mm, where the edges bend into the tips: at this scale, the picture of "
        f"{description.width_px}x{description.height_px} pixels shows {shown}. State the right scale, or measure "
        "farther below the tips (--below-tip-mm)."
    ]


def _about_unseen(description: Description, series: GapSeries) -> list[str]:
    """Warning for a compression that may hide the fingers, for which other advice (light, focus) would be wrong."""
    count = sum(series.counts[status] for status in HIDDEN_BY_COMPRESSION)
    pixels = series.frames * description.width_px * description.height_px
    if not (description.lossy and count and pixels):
        return []
    bits = 8.0 * sum(file.stat().st_size for file in description.files if file.is_file()) / pixels
    if not 0.0 < bits < LEAST_BITS_A_PIXEL:
        return []
    return [
        f"In {count} of {series.frames} frames no fingers with straight edges were found, and the recording has "
        f"{bits:.2g} bits per pixel ({description.codec}): compression to less than {LEAST_BITS_A_PIXEL:g} bits per "
        "pixel can destroy the edges. Record at a higher bit rate, or losslessly, before you change light, focus or "
        "region."
    ]


def _about_fingers(series: GapSeries) -> list[str]:
    """Warning if frames disagree about whether the fingers are dark or light."""
    if len(series.votes) < 2:
        return []
    counts = " and ".join(f"{tone} in {count}" for tone, count in series.votes.most_common())
    taken = "dark" if series.votes["dark"] >= series.votes["light"] else "light"
    return [
        f"The first frames disagree about the brightness of the fingers: {counts} of them. All frames were measured "
        f"with {taken} fingers: look at frames of both kinds with --steps, and state --fingers dark or --fingers light."
    ]


def _about_light(series: GapSeries) -> list[str]:
    """Warning if the contrast changes abruptly and for good, unless nothing depends on the light."""
    change = light_change(series.contrast)
    if change is None or series.camera.response.is_known:
        return []
    first, frame, last = (int(series.frame_numbers()[0][k]) for k in (0, change.at, -1))
    return [
        f"From frame {frame} on, the contrast of the edges is {change.ratio:.2f} times what it was before, as after a "
        "change of exposure, gain or picture profile. The camera is judged by the first frames, and u_shift_px does "
        f"not include that another response may hold afterwards: measure the parts by themselves (--frames "
        f"{first}:{frame - 1} and --frames {frame}:{last}), and record with these settings fixed."
    ]


def about_edges(series: GapSeries) -> list[str]:
    """Sentences about disturbances of the edges: which kind, in how many frames, and the remedy."""
    return [
        f"In {count} {'frame' if count == 1 else 'frames'} {BESIDE[what]}"
        for what, count in series.beside.most_common()
    ]


def _statistics(series: GapSeries) -> dict[str, float | int | None]:
    gap_mm = series.gap_mm
    u_mm = series.u_mm if series.has_budget else np.empty(0)
    return {
        "count": int(gap_mm.size),
        "mean_mm": _of(np.mean, gap_mm),
        "standard_deviation_mm": float(np.std(gap_mm, ddof=1)) if gap_mm.size > 1 else None,
        "least_mm": _of(np.min, gap_mm),
        "median_mm": _of(np.median, gap_mm),
        "greatest_mm": _of(np.max, gap_mm),
        "median_u_gap_mm": _of(np.median, u_mm),
        "median_u_random_mm": _of(np.median, series.u_random_mm),
        "median_u_gap_px": _of(np.median, series.u_gap_px),
    }


def _of(statistic: Any, values: NDArray[np.float64]) -> float | None:
    return float(statistic(values)) if values.size else None


def _scale(scale: Scale, file: Path | None) -> dict[str, Any]:
    if not isinstance(scale, Calibration):
        return {"kind": "stated", "px_per_mm": scale.px_per_mm, "u_px_per_mm": None}
    return {
        "kind": "stated" if is_stated(scale) else "calibration",
        "file": None if file is None else str(file),
        "sha256": None if file is None else _sha256((file,)),
        "px_per_mm": scale.px_per_mm,
        "u_px_per_mm": scale.u_px_per_mm,
        "edge_bias_px": scale.edge_bias_px,
        "u_edge_bias_px": scale.u_edge_bias_px,
        "reference": [asdict(reference) for reference in scale.references],
        "made_at": scale.made_at,
    }


def _uncertainty(scale: Scale, settings: Mapping[str, Any]) -> dict[str, Any]:
    response = (
        f"the camera's response, taken as {settings.get('response', 'linear')} and not measured: change of the gap "
        "under other possible responses, as far as the calibration does not correct it (u_shift_px includes all of it)"
    )
    is_assumed = not settings.get("response_known", True)
    random = (
        "u_random_mm and u_gap_px, the parts that change from frame to frame: noise at both edges, noise of both tips "
        "through the slope of the edges, residuals of the edge model, compression"
    )
    never = [
        "movement during the exposure",
        "change of the set-up since the calibration (focus, camera, light)",
        "difference between the outline of a finger and the edge seen by the camera (thickness, burr)",
    ]
    if not isinstance(scale, Calibration):
        return {
            "coverage_factor": COVERAGE_FACTOR,
            "expanded": "U = k u_random_mm with k = 2; U includes only the random part.",
            "covers": [random],
            "not_included": [
                f"the uncertainty of the scale: {scale.px_per_mm:g} px/mm was stated without an uncertainty, "
                "so that u_gap_mm is empty; calibrate to obtain it",
                "edge bias (blooming), lens distortion, tilt, distance from the plane of the scale, temperature",
                "bright rims, walls and shadows beside the edges, and light above full scale",
                *([response] if is_assumed else []),
                *never,
            ],
        }
    return {
        "coverage_factor": COVERAGE_FACTOR,
        "expanded": "U = k u_gap_mm with k = 2 (JCGM 100); about 95 %.",
        "covers": [
            random,
            f"the scale as stated, {scale.px_per_mm:g} px/mm with u = {scale.u_px_per_mm:g} px/mm (k = 1), and an "
            f"unknown edge bias within +-{scale.limits.edge_bias_px:g} px"
            if is_stated(scale)
            else "scale and edge bias with their covariance, from the calibration",
            "effects of bright rims, walls, shadows and light just above full scale, as far as the edges show them",
            *([response] if is_assumed else []),
            *(
                f"{words}: {scale.how_stated(name, unit)}"
                for name, words, unit in (
                    ("plane_mm", "distance of the fingers from the calibration plane", "mm"),
                    ("tilt_deg", "tilt of the plane", "degrees"),
                    ("lens_relative", "uncorrected lens distortion, relative", ""),
                    ("temperature_k", "temperature", "K"),
                )
                if hasattr(scale.limits, name)
            ),
        ],
        "not_included": never,
    }


def _sha256(files: tuple[Path, ...]) -> str | None:
    """Hash of one file's bytes; for several files, the hash of their names and hashes in order.

    The function returns None for a live source.
    """
    if not files:
        return None
    hashes = [_hash_of(file) for file in files]
    if len(files) == 1:
        return hashes[0]
    together = "".join(f"{found}  {file.name}\n" for found, file in zip(hashes, files, strict=True))
    return hashlib.sha256(together.encode()).hexdigest()


def _hash_of(file: Path) -> str:
    found = hashlib.sha256()
    try:
        with file.open("rb") as content:
            while block := content.read(BYTES_AT_ONCE):
                found.update(block)
    except OSError as error:
        raise InputFileError(f"{file} could not be read again ({error.strerror}).") from error
    return found.hexdigest()


def _beside(beside: BesideEdges) -> dict[str, object]:
    """Numbers of what stands beside the edges, without the profile of its light."""
    return {key: value for key, value in asdict(beside).items() if key != "added"}
