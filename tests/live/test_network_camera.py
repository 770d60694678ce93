"""A network camera on the loopback interface: every frame is measured; interruption and restoration."""

import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import av
import pytest

from tests.live.conftest import single_pictures

SCALE = ("--px-per-mm", "34")
WATCHED_S = 20.0
CUT_S = 3.0
PROMPT_AMONG = 200
# MPEG's clock has 90 000 ticks a second; each end of a step is rounded to microseconds too.
CLOCK_TICK_S = 1.5e-5


@pytest.mark.slow
def test_every_frame_is_measured_and_a_cut_is_a_gap(
    live: Callable[..., Any],
    camera: Any,
    measured: Callable[..., str],
    rows: Callable[[Path], list[dict[str, str]]],
) -> None:
    view = live(camera.address, *SCALE, "--no-page", "--json")
    view.until(lambda seen: len(seen.lines()) > 10)
    began_s = time.monotonic()
    view.until(lambda seen: time.monotonic() - began_s > WATCHED_S, within_s=6 * WATCHED_S)
    camera.stop()
    before = len(view.lines())
    view.until(lambda seen: "is interrupted" in seen.text())
    time.sleep(CUT_S)
    camera.start()
    view.until(lambda seen: len(seen.lines()) > before + 25)
    assert view.stop() == 0

    lines = view.lines()
    assert [line["frame"] for line in lines] == list(range(len(lines)))
    assert {line["status"] for line in lines[: before - 1]} == {"ok"}
    # ffmpeg's clock and ours agree: as many frames as the time holds. The promptest of many frames tell that, since a
    # busy machine is late now and then.
    late_s = [line["time_s"] - 0.04 * line["frame"] for line in lines[:before]]
    assert min(late_s[-PROMPT_AMONG:]) == pytest.approx(min(late_s[:PROMPT_AMONG]), abs=4 * 0.04)
    longest_s = max(after["time_s"] - line["time_s"] for line, after in pairwise(lines))
    assert longest_s > CUT_S
    assert "The source is back" in view.text()

    (run,) = view.runs()
    table = (run / "gaps.csv").read_text()
    assert len(rows(run / "gaps.csv")) == len(lines)
    assert measured(run / "video.mp4", *SCALE) == table
    # The camera's own pictures, to the byte.
    sent = set(single_pictures(camera.pictures))
    with av.open(run / "video.mp4") as video:
        kept = [bytes(packet) for packet in video.demux(video=0) if packet.size]
    assert len(kept) == len(lines)
    assert set(kept) <= sent


@pytest.mark.slow
def test_a_stream_of_h264_keeps_its_own_times_and_begins_with_a_whole_picture(
    live: Callable[..., Any], camera: Any, measured: Callable[..., str], rows: Callable[[Path], list[dict[str, str]]]
) -> None:
    camera.stop()
    coding = "-vf format=yuv420p -c:v libx264 -preset ultrafast -tune zerolatency -g 10 -f mpegts"
    camera.coding = tuple(coding.split(" "))
    camera.start()
    view = live(camera.address, *SCALE, "--no-page", "--json")
    view.until(lambda seen: len(seen.lines()) > 40)
    assert view.stop() == 0
    (run,) = view.runs()
    times = [float(row["time_s"]) for row in rows(run / "gaps.csv")]
    steps = [after - before for before, after in pairwise(times)]
    assert steps == pytest.approx([0.04] * len(steps), abs=CLOCK_TICK_S)
    assert measured(run / "video.mp4", *SCALE) == (run / "gaps.csv").read_text()
