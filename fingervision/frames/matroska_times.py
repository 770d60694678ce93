"""Check the times of Matroska clusters, because one damaged number in a cluster shifts all of its frames.

A cluster states one time, relative to which the times of its blocks are given, so that one flipped bit shifts seconds
of frames forward or back. The file's index (cues) repeats the times of the key frames: a cluster that contains none of
the times stated by its cues has a wrong time. Without cues, clusters must follow one another in time: of two that
overlap, neither is trusted unless a cue confirms it, and the last cluster must lie within the stated duration.

Source: RFC 9559 (Matroska), 5.1.3 (clusters), 5.1.5 (cues); RFC 8794 (EBML), 4 and 5 (variable-size numbers).
"""

import mmap
import struct
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

SEGMENT, CLUSTER, CUES, INFO = b"\x18\x53\x80\x67", b"\x1f\x43\xb6\x75", b"\x1c\x53\xbb\x6b", b"\x15\x49\xa9\x66"
TIMESTAMP, SIMPLE_BLOCK, BLOCK_GROUP, BLOCK = b"\xe7", b"\xa3", b"\xa0", b"\xa1"
CUE_POINT, CUE_TIME, CUE_PLACE, CUE_TRACK, CUE_CLUSTER = b"\xbb", b"\xb3", b"\xb7", b"\xf7", b"\xf1"
TRACKS, TRACK, TRACK_NUMBER = b"\x16\x54\xae\x6b", b"\xae", b"\xd7"
DURATION = b"\x44\x89"
# Pictures that are coded out of order overlap between clusters by no more than the longest reordering of H.264.
MOST_REORDERED = 16


@dataclass(frozen=True, slots=True)
class _Element:
    """An EBML element: its name, and the position of its content."""

    name: bytes
    begin: int
    end: int


@dataclass(slots=True)
class _Cluster:
    """A cluster: its position, and the times of its video blocks."""

    begin: int
    ticks: list[int] = field(default_factory=list)


class ClusterTimes:
    """Finds the clusters of a file whose times are not trustworthy.

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
            with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
                track = _track(content, stream)
                clusters = _clusters(content, track)
                cues, duration = _cues(content, track), _duration(content)
        except (OSError, ValueError):
            return
        self._begins = [cluster.begin for cluster in clusters]
        self._doubtful = _doubtful(clusters, cues, duration)

    def is_doubtful(self, position: int | None) -> bool:
        """Whether the packet at this position has an untrustworthy time."""
        at = -1 if position is None else bisect_right(self._begins, position) - 1
        return at >= 0 and self._doubtful[at]


def _track(content: mmap.mmap, stream: int) -> int:
    """Track number in the blocks of a stream; streams are counted in the order of their tracks."""
    at = content.find(TRACKS)
    while at >= 0:
        tracks = _element(content, at)
        entries = [] if tracks is None else [each for each in _children(content, tracks) if each.name == TRACK]
        if stream < len(entries) and (number := _child(content, entries[stream], TRACK_NUMBER)) is not None:
            return int.from_bytes(content[number.begin : number.end], "big")
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


def _clusters(content: mmap.mmap, track: int) -> list[_Cluster]:
    found: list[_Cluster] = []
    at = content.find(CLUSTER)
    while at >= 0:
        element = _element(content, at)
        behind = content.find(CLUSTER, at + 4)
        if element is None:
            at = behind
            continue
        cluster, time = _Cluster(at), None
        inside = element.begin
        while inside < element.end and (child := _element(content, inside)) is not None:
            if child.name == TIMESTAMP:
                time = int.from_bytes(content[child.begin : child.end], "big")
            elif child.name == CLUSTER or child.end > element.end:
                break
            block = child if child.name == SIMPLE_BLOCK else None
            if child.name == BLOCK_GROUP:
                block = _child(content, child, BLOCK)
            if block is not None and time is not None:
                number, begin = _number(content, block.begin, keep_marker=False)
                if number == track and begin + 2 <= block.end:
                    cluster.ticks.append(time + struct.unpack(">h", content[begin : begin + 2])[0])
            inside = child.end
        found.append(cluster)
        at = content.find(CLUSTER, max(inside, at + 4))
    return found


def _cues(content: mmap.mmap, track: int) -> dict[int, set[int]]:
    """Times stated by the index, by the position of the cluster."""
    stated: dict[int, set[int]] = {}
    segment, at = content.find(SEGMENT), content.rfind(CUES)
    whole = _element(content, segment) if segment >= 0 else None
    cues = _element(content, at) if at >= 0 else None
    if whole is None or cues is None:
        return stated
    for point in _children(content, cues):
        time = _child(content, point, CUE_TIME) if point.name == CUE_POINT else None
        if time is None:
            continue
        tick = int.from_bytes(content[time.begin : time.end], "big")
        for place in _children(content, point):
            if place.name != CUE_PLACE:
                continue
            named, cluster = _child(content, place, CUE_TRACK), _child(content, place, CUE_CLUSTER)
            if named is not None and cluster is not None:
                is_ours = int.from_bytes(content[named.begin : named.end], "big") == track
                begin = whole.begin + int.from_bytes(content[cluster.begin : cluster.end], "big")
                if is_ours:
                    stated.setdefault(begin, set()).add(tick)
    return stated


def _duration(content: mmap.mmap) -> float | None:
    """Duration in ticks; None if it is not stated."""
    at = content.find(INFO)
    while at >= 0:  # the name stands in the file's table of contents too
        info = _element(content, at)
        stated = None if info is None else _child(content, info, DURATION)
        if stated is not None and stated.end - stated.begin in (4, 8):
            form = ">f" if stated.end - stated.begin == 4 else ">d"
            return float(struct.unpack(form, content[stated.begin : stated.end])[0])
        at = content.find(INFO, at + 4)
    return None


def _children(content: mmap.mmap, parent: _Element) -> list[_Element]:
    found, at = [], parent.begin
    while at < parent.end and (child := _element(content, at)) is not None and child.end <= parent.end:
        found.append(child)
        at = child.end
    return found


def _child(content: mmap.mmap, parent: _Element, name: bytes) -> _Element | None:
    return next((child for child in _children(content, parent) if child.name == name), None)


def _element(content: mmap.mmap, at: int) -> _Element | None:
    """The element that starts at this position; None if there is none.

    An element of unknown length, as in live streams, extends to the end of the file.
    """
    name, begin = _number(content, at, keep_marker=True)
    if begin == at or begin - at > 4:
        return None
    size, inside = _number(content, begin, keep_marker=False)
    if inside == begin:
        return None
    unknown = size == (1 << (7 * (inside - begin))) - 1
    end = len(content) if unknown else min(inside + size, len(content))
    return _Element(name.to_bytes(begin - at, "big"), inside, end)


def _number(content: mmap.mmap, at: int, *, keep_marker: bool) -> tuple[int, int]:
    """Read a number of 1 to 8 bytes and the position after it, which equals the start if there is no number."""
    if at >= len(content) or content[at] == 0:
        return 0, at
    length = 9 - content[at].bit_length()
    if at + length > len(content):
        return 0, at
    value = int.from_bytes(content[at : at + length], "big")
    return value if keep_marker else value & ((1 << (7 * length)) - 1), at + length
