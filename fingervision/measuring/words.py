"""The result of a measurement as sentences, as the command prints them, and as one line."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fingervision.domain.status import Status
from fingervision.measuring.gap_budget import RESPONSE
from fingervision.measuring.series import GapSeries

COVERAGE_FACTOR = 2.0


def result_sentences(summary: Mapping[str, Any], series: GapSeries) -> list[str]:
    """Sentences with the number of measured frames, reasons for the others, the gap, its uncertainty, and advice.

    The gauges have their own sentences in front of the advice.
    """
    gap = summary["gap"]
    has_fingers = summary["settings"]["fingers"] != "none"
    lines = [f"{gap['count']} of {series.frames} frames measured."]
    if not has_fingers:
        lines = [f"{series.frames} frames, without a gap between fingers."]
    if gap["count"] and series.is_minority:
        lines = [
            f"Only {gap['count']} of {series.frames} frames {'was' if gap['count'] == 1 else 'were'} measured: the "
            "numbers below describe these frames, and not the recording."
        ]
    lines += [
        f"  {summary['counts'][status]} {status}, first frame {why['first_frame']}: {why['words']}"
        for status, why in summary["why"].items()
        if has_fingers or status in (Status.DAMAGED, Status.DUPLICATE)
    ]
    if gap["count"]:
        lines.append(f"Gap {gap['least_mm']:.4f} to {gap['greatest_mm']:.4f} mm, mean {gap['mean_mm']:.4f} mm.")
        if gap["median_u_gap_mm"] is not None:
            lines.append(
                f"U = {2e3 * gap['median_u_gap_mm']:.2f} µm (k = 2, median), of which from frame to frame "
                f"{2e3 * gap['median_u_random_mm']:.2f} µm."
            )
        else:
            lines.append(
                f"U = {2e3 * gap['median_u_random_mm']:.2f} µm (k = 2, median) from frame to frame; U does not "
                "include the uncertainty of the scale, which was not stated."
            )
        lines += [*_learnt_camera(summary), *_assumed_response(summary, series)]
    gauges = [gauge_sentence(name, gauge) for name, gauge in summary.get("gauges", {}).items()]
    return [*lines, *gauges, *summary["advice"]]


def gauge_sentence(name: str, gauge: Mapping[str, Any]) -> str:
    """Sentence about one gauge, from its entry in summary.json."""
    frames = sum(gauge["counts"].values())
    ranges = [
        f"{quantity} {found['least']:.4f} to {found['greatest']:.4f} {found['unit']}"
        for quantity, found in gauge["quantities"].items()
    ]
    why = [f"{gauge['counts'][status]} {status}" for status in gauge["why"]]
    words = "; ".join([*ranges, *why])
    return f"Gauge {name} ({gauge['kind']}): {gauge['counts'].get('ok', 0)} of {frames} frames; {words}."


def _assumed_response(summary: Mapping[str, Any], series: GapSeries) -> list[str]:
    """Sentence about the error due to an assumed response, if no budget includes it and it exceeds the uncertainty."""
    gap, settings = summary["gap"], summary["settings"]
    in_budget = any(part["source"] == RESPONSE and part["rms_u_mm"] > 0.0 for part in summary["uncertainty"]["parts"])
    if settings.get("response_known", True) or in_budget:
        return []
    u_mm = gap["median_u_random_mm"] if gap["median_u_gap_mm"] is None else gap["median_u_gap_mm"]
    moved_mm = COVERAGE_FACTOR * float(np.median(series.response_px)) / summary["scale"]["px_per_mm"]
    if moved_mm <= COVERAGE_FACTOR * u_mm:
        return []
    if words := summary["camera"]["response"]["words"]:
        return [
            f"{words} This may change the gap by {1e3 * moved_mm:.1f} µm (k = 2, median), which U does not include."
        ]
    return [
        f"The camera's response is not known and was taken as {settings['response']}; what is open about it may change "
        f"the gap by {1e3 * moved_mm:.1f} µm (k = 2, median), which U does not include: state the response with "
        "--response, or measure it with `fingervision calibrate response`."
    ]


def _learnt_camera(summary: Mapping[str, Any]) -> list[str]:
    """Line on the camera, if its response was learnt from the recording as another than the linear one."""
    response, spread = summary["camera"]["response"], summary["camera"]["point_spread"]
    if response["origin"] != "learnt" or response["value"] == "linear":
        return []
    blur = "" if spread["value"] is None else f", blur {spread['value']:.2f} px"
    return [f"Camera, learnt from the recording: response {response['value']} (levels converted to light){blur}."]


def in_one_line(summary: Mapping[str, Any], series: GapSeries) -> str:
    """The result in one line: `gap 0.4021 mm, U = 1.20 µm (k = 2), 1 frame`."""
    gap, frames = summary["gap"], series.frames
    of = f"{frames} frame{'' if frames == 1 else 's'}"
    if summary["settings"]["fingers"] == "none":
        each = [f"{name} in {gauge['counts'].get('ok', 0)}" for name, gauge in summary.get("gauges", {}).items()]
        return f"gauges in {of}: {', '.join(each) or 'none'}"
    if not gap["count"]:
        counts = ", ".join(f"{count} {status.value}" for status, count in series.counts.most_common())
        return f"no gap in {of}: {counts}; report() says why" if counts else "no frame"
    least, greatest = gap["least_mm"], gap["greatest_mm"]
    values = f"gap {least:.4f} mm" if gap["count"] == 1 else f"gap {least:.4f} to {greatest:.4f} mm"
    u_mm, only = gap["median_u_gap_mm"], ""
    if u_mm is None:
        u_mm, only = gap["median_u_random_mm"], ", from frame to frame only"
    median = "" if gap["count"] == 1 else ", median"
    found = of if gap["count"] == frames else f"{gap['count']} of {of} with a gap"
    bad = series.counts[Status.DAMAGED]
    damage = f", {bad} damaged" if bad else ""
    few = f"only {gap['count']} of {of} measured: " if series.is_minority else ""
    return f"{few}{values}, U = {COVERAGE_FACTOR * 1e3 * u_mm:.2f} µm (k = 2{median}{only}), {found}{damage}"


__all__ = ["gauge_sentence", "in_one_line", "result_sentences"]
