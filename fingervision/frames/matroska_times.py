"""Check the times of Matroska clusters, because one damaged number in a cluster shifts all of its frames.

A cluster states one time, relative to which the times of its blocks are given, so that one flipped bit shifts seconds
of frames forward or back. The file's index (cues) repeats the times of the key frames: a cluster that contains none of
the times stated by its cues has a wrong time. Without cues, clusters must follow one another in time. If two clusters
overlap, neither cluster is trusted unless a cue confirms its time; the last cluster must lie within the stated
duration.

Source: RFC 9559 (Matroska), 5.1.3 (clusters), 5.1.5 (cues).
"""

import struct
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from fingervision.frames.ebml import FileBytes, child, children, element, number

SEGMENT, CLUSTER, CUES, INFO = b"\x18\x53\x80\x67", b"\x1f\x43\xb6\x75", b"\x1c\x53\xbb\x6b", b"\x15\x49\xa9\x66"
TIMESTAMP, SIMPLE_BLOCK, BLOCK_GROUP, BLOCK = b"\xe7", b"\xa3", b"\xa0", b"\xa1"
CUE_POINT, CUE_TIME, CUE_PLACE, CUE_TRACK, CUE_CLUSTER = b"\xbb", b"\xb3", b"\xb7", b"\xf7", b"\xf1"
TRACKS, TRACK, TRACK_NUMBER = b"\x16\x54\xae\x6b", b"\xae", b"\xd7"
DURATION = b"\x44\x89"
# Largest number of frames by which two clusters may overlap in time, the longest reordering of H.264.
MOST_REORDERED = 16


@dataclass(slots=True)
class _Cluster:
    """A cluster: its position, and the times of its video blocks."""

    begin: int
    ticks: list[int] = field(default_factory=list)


class ClusterTimes:
    """The clusters of a file, each with the result of checking its time.

    Parameters
    ----------
    path : Path
        The file.
    stream : int
        Number of the video stream in the file, from 0.
    """

    def __init__(self, path: Path, stream: int) -> None:
        self._begins: list[int] = []
        self._doubtful: list[bool] = []
        try:
            with path.open("rb") as file:
                content = FileBytes(file)
                track = _track(content, stream)
                clusters = _clusters(content, track)
                cues, duration = _cues(content, track), _duration(content)
        except (OSError, ValueError):
            return
        self._begins = [cluster.begin for cluster in clusters]
        self._doubtful = _doubtful(clusters, cues, duration)

    def is_doubtful(self, position: int | None) -> bool:
        """Whether the packet at a given position has an untrustworthy time."""
        at = -1 if position is None else bisect_right(self._begins, position) - 1
        return at >= 0 and self._doubtful[at]


def _track(content: FileBytes, stream: int) -> int:
    """Track number in the blocks of a stream; streams are counted in the order of their tracks."""
    at = content.find(TRACKS)
    while at >= 0:
        tracks = element(content, at)
        entries = [] if tracks is None else [each for each in children(content, tracks) if each.name == TRACK]
        if stream < len(entries) and (named := child(content, entries[stream], TRACK_NUMBER)) is not None:
            return int.from_bytes(content[named.begin : named.end], "big")
        at = content.find(TRACKS, at + 4)
    return stream + 1


def _doubtful(clusters: list[_Cluster], cues: dict[int, set[int]], duration: float | None) -> list[bool]:
    confirmed, doubtful = [], []
    for cluster in clusters:
        stated = cues.get(cluster.begin, set())
        confirmed.append(bool(stated) and stated <= set(cluster.ticks))
        doubtful.append(bool(stated) and bool(cluster.ticks) and stated.isdisjoint(cluster.ticks))
    in_order = all(a <= b for cluster in clusters for a, b in pairwise(cluster.ticks))
    steps = [b - a for cluster in clusters for a, b in pairwise(cluster.ticks) if b > a]
    allowed = 0 if in_order or not steps else MOST_REORDERED * sorted(steps)[len(steps) // 2]
    filled = [k for k, cluster in enumerate(clusters) if cluster.ticks and not doubtful[k]]
    for one, other in pairwise(filled):
        if max(clusters[one].ticks) > min(clusters[other].ticks) + allowed:
            for k in (one, other):
                doubtful[k] = doubtful[k] or not confirmed[k]
    if filled and duration is not None and duration > 0.0:
        last = filled[-1]
        if max(clusters[last].ticks) > duration and not confirmed[last]:
            doubtful[last] = True
    return doubtful


def _clusters(content: FileBytes, track: int) -> list[_Cluster]:
    found: list[_Cluster] = []
    at = content.find(CLUSTER)
    while at >= 0:
        whole = element(content, at)
        if whole is None:
            at = content.find(CLUSTER, at + 4)
            continue
        cluster, time = _Cluster(at), None
        inside = whole.begin
        while inside < whole.end and (part := element(content, inside)) is not None:
            if part.name == TIMESTAMP:
                time = int.from_bytes(content[part.begin : part.end], "big")
            elif part.name == CLUSTER or part.end > whole.end:
                break
            block = part if part.name == SIMPLE_BLOCK else None
            if part.name == BLOCK_GROUP:
                block = child(content, part, BLOCK)
            if block is not None and time is not None:
                named, begin = number(content, block.begin, keep_marker=False)
                if named == track and begin + 2 <= block.end:
                    cluster.ticks.append(time + struct.unpack(">h", content[begin : begin + 2])[0])
            inside = part.end
        found.append(cluster)
        at = content.find(CLUSTER, max(inside, at + 4))
    return found


def _cues(content: FileBytes, track: int) -> dict[int, set[int]]:
    """Times stated in the file's index, for each position of a cluster."""
    stated: dict[int, set[int]] = {}
    segment, at = content.find(SEGMENT), content.rfind(CUES)
    whole = element(content, segment) if segment >= 0 else None
    cues = element(content, at) if at >= 0 else None
    if whole is None or cues is None:
        return stated
    for point in children(content, cues):
        time = child(content, point, CUE_TIME) if point.name == CUE_POINT else None
        if time is None:
            continue
        tick = int.from_bytes(content[time.begin : time.end], "big")
        for place in children(content, point):
            if place.name != CUE_PLACE:
                continue
            named, cluster = child(content, place, CUE_TRACK), child(content, place, CUE_CLUSTER)
            if named is not None and cluster is not None:
                is_ours = int.from_bytes(content[named.begin : named.end], "big") == track
                begin = whole.begin + int.from_bytes(content[cluster.begin : cluster.end], "big")
                if is_ours:
                    stated.setdefault(begin, set()).add(tick)
    return stated


def _duration(content: FileBytes) -> float | None:
    """Duration in ticks; None if it is not stated."""
    at = content.find(INFO)
    while at >= 0:  # the name also occurs in the file's table of contents
        info = element(content, at)
        stated = None if info is None else child(content, info, DURATION)
        if stated is not None and stated.end - stated.begin in (4, 8):
            form = ">f" if stated.end - stated.begin == 4 else ">d"
            return float(struct.unpack(form, content[stated.begin : stated.end])[0])
        at = content.find(INFO, at + 4)
    return None
