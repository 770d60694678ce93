"""Requests to record a run and to save a picture."""

from datetime import UTC, datetime
from typing import Any

import cv2

from fingervision.domain.errors import OutputError, StateError
from fingervision.live.commands.asking import Answer, Request, seen_of
from fingervision.live.session import Session
from fingervision.live.view import View


def _session(view: View) -> Session:
    if not isinstance(view, Session):
        raise StateError("Only a camera or a stream can be recorded, but this source is a recording.")
    return view


def _record(view: View, request: Request) -> Answer:
    _session(view).record()
    return Answer()


def _stop(view: View, request: Request) -> Answer:
    _session(view).stop_recording()
    return Answer()


def _snapshot(view: View, request: Request) -> Answer:
    seen = seen_of(view)
    path = view.out / f"snapshot_{datetime.now(UTC).strftime('%Y-%m-%dT%H-%M-%S-%fZ')}.png"
    pixels: Any = seen.frame.pixels
    coded = cv2.imencode(".png", pixels if pixels.ndim == 2 else pixels[:, :, ::-1])[1].tobytes()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(coded)
    except OSError as error:
        raise OutputError(f"{path} could not be written ({error.strerror}): free disk space.") from error
    return Answer(f"Snapshot of frame {seen.frame.index}: {path}")


COMMANDS = {"record": _record, "stop": _stop, "snapshot": _snapshot}
