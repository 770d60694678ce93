"""The page of a recording as one file: graph, values, and the pictures of some frames, to look at without a server."""

import json
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from fingervision.domain.errors import StateError
from fingervision.live.frame_measurement import Seen
from fingervision.live.playback.playback import Playback

# Memory for the pictures; further frames are left out.
MOST_BYTES = 12_000_000
# Longest time in which a frame must be in view.
SHOWN_WITHIN_S, LOOK_EVERY_S = 30.0, 0.01
# Decimals of the numbers in the graph: tenths of a nanometre, microseconds.
PLACES = 7
SOCKET, SAVED = "socket.js", "saved_page.js"
# Nothing is fetched, from wherever the file is opened.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; img-src data: blob:; "
    "form-action 'none'; base-uri 'none'"
)


def seen_at(view: Playback, frame: int) -> Seen:
    """Show a frame, and return it with its measurement.

    Raises
    ------
    StateError
        The frame is not shown in time, or another page moves the recording meanwhile.
    """
    view.seek(frame)
    until_s = monotonic() + SHOWN_WITHIN_S
    while (seen := view.seen) is None or seen.frame.index != frame or seen.row is None:
        if view.frame != frame or monotonic() > until_s:
            raise StateError("The page was not saved, because the recording was moved meanwhile: save the page again.")
        sleep(LOOK_EVERY_S)
    return seen


def saved_page(folder: Path, content: Mapping[str, Any], pictures: Sequence[tuple[Mapping[str, Any], bytes]]) -> str:
    """Compose the file.

    Parameters
    ----------
    folder : Path
        Folder of the page's scripts and styles.
    content : mapping
        State, points and messages, as the server sends them.
    pictures : sequence of (mapping, bytes)
        Values and measured points of a frame, and its picture as JPEG.

    Returns
    -------
    str
        The text in HTML. Scripts, styles and pictures stand in it, and it asks for nothing from anywhere.
    """
    scripts = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.js"))}
    plot = scripts.pop("uPlot.iife.min.js")
    scripts[SOCKET] = scripts.pop(SAVED)
    # A script of a data address has no folder of its own, so that its imports must be bare names.
    imports = {
        f"page/{name}": "data:text/javascript;base64," + _base64(text.replace('"/page/', '"page/').encode())
        for name, text in scripts.items()
    }
    panels = [name for name in scripts if name.startswith("panel_")]
    frames = [{**about, "picture": _base64(picture)} for about, picture in pictures]
    saved_at = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    told = json.dumps(_rounded({**content, "frames": frames, "saved_at": saved_at}), separators=(",", ":"))
    told = told.replace("<", r"\u003c")  # no text of a user ends the script
    page = (folder / "index.html").read_text(encoding="utf-8")
    page = re.sub(r'<link rel="icon"[^>]*>\n', "", page)
    page = re.sub(
        r'<link rel="stylesheet" href="/page/([^"]+)">',
        lambda found: f"<style>\n{(folder / found[1]).read_text(encoding='utf-8')}</style>",
        page,
    )
    page = page.replace("<title>", f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n<title>', 1)
    started = "".join(f'import "page/{name}";\n' for name in (*panels, "live.js"))
    foot = (
        f'<script type="importmap">{json.dumps({"imports": imports})}</script>\n'
        f'<script type="application/json" id="saved">{told}</script>\n'
        f'<script type="module">\n{started}</script>'
    )
    before, after = page.split("<!-- scripts -->")
    return before.replace('<script src="/page/uPlot.iife.min.js"></script>', f"<script>{plot}</script>") + foot + after


def _base64(data: bytes) -> str:
    return b64encode(data).decode("ascii")


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, PLACES)
    if isinstance(value, Mapping):
        return {name: _rounded(each) for name, each in value.items()}
    return [_rounded(each) for each in value] if isinstance(value, list | tuple) else value
