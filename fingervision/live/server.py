"""Web server of the browser page: its files, a WebSocket for the live view, and the gaps as a file."""

import asyncio
import errno
import html
import os
import re
import secrets
import socket
from contextlib import suppress
from functools import cache
from mimetypes import guess_type
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from fingervision.domain.errors import FingervisionError, ProcessError, StateError, UsageError
from fingervision.live.access import Access
from fingervision.live.commands import modules
from fingervision.live.commands.model import MODEL
from fingervision.live.guard import EVERYWHERE, VIEWER, WRITER, Guard, PatientProtocol
from fingervision.live.page_socket import ONLY_LOOKS, TRY_AGAIN_LATER, PageSocket
from fingervision.live.pen import Pen
from fingervision.live.playback.gauge_following import GAUGES, GaugesBeside
from fingervision.live.playback.playback import Playback
from fingervision.live.playback.second_recording import SECOND
from fingervision.live.preview import coded, page_file
from fingervision.live.supervisor import sentence
from fingervision.live.view import View
from fingervision.storage.gaps_csv import GapsCsv
from fingervision.storage.gauge_files import GaugesCsv
from fingervision.storage.out_folder import make_out_folder, out_folder

if TYPE_CHECKING:
    from fingervision.live.comparison.comparison import Comparison

# Saving of the gaps that the browser page shows.

DRIVE_COLUMNS = ("run", "input_mm", "force_n")
SAVED_GAPS, SAVED_GAUGES = "live_gaps.csv", "live_gauges.csv"


def save_gaps(view: View) -> Path:
    """Save the gaps in memory in the format of gaps.csv; for a recording, save the table that `measure` wrote.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    if view.table is not None:
        return view.table
    make_out_folder(view.out)
    path = view.out / SAVED_GAPS
    rows = list(view.rows(view.oldest_row, view.row_count))
    is_driven = any(row.input_mm is not None for row in rows)
    with GapsCsv(path, DRIVE_COLUMNS if is_driven else ()) as table:
        table.add(rows)
    return path


def save_gauges(view: View) -> Path:
    """Save the readings of the gauges in the format of gauges.csv.

    Raises
    ------
    StateError
        There are no gauges, or they are not measured in all frames yet.
    OutputError
        The file cannot be written.
    """
    beside = view.features.get(GAUGES)
    if not isinstance(beside, GaugesBeside):
        raise StateError("Gauges must be drawn before their values can be saved, but there are none.")
    beside.refuse_part()
    make_out_folder(view.out)
    path = view.out / SAVED_GAUGES
    with GaugesCsv(path) as table:
        table.add(beside.rows)
    return path


# Token in the address of the browser page, stored in the output folder for reconnecting after a restart.

TOKEN_FILE, VIEWER_FILE = ".live_token", ".live_viewer_token"
TOKEN_BYTES = 18


def kept_token(out: Path, file_name: str = TOKEN_FILE) -> str:
    """Read the token from a folder, or create a token file that only this user can read.

    Parameters
    ----------
    out : Path
        The folder.
    file_name : str
        `TOKEN_FILE` for users who control the live view, `VIEWER_FILE` for users who only watch.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    path = out / file_name
    with out_folder(out):
        with suppress(FileNotFoundError, UnicodeDecodeError):
            found = path.read_text(encoding="ascii").strip()
            if re.fullmatch(r"[A-Za-z0-9_-]{24,}", found) and path.stat().st_mode & 0o077 == 0:
                return found
        path.unlink(missing_ok=True)
        token = secrets.token_urlsafe(TOKEN_BYTES)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
            file.write(token + "\n")
    return token


# Files of the browser page, one script per topic; every file panel_NAME.js is loaded as a panel automatically.

PAGE = Path(__file__).parent / "page"
SCRIPTS = "<!-- scripts -->"
LAST = "live.js"


@cache
def files() -> dict[str, bytes]:
    """The files that the server delivers, by name; any other name gives the error "not found"."""
    return {path.name: path.read_bytes() for path in PAGE.iterdir() if path.is_file() and path.name != "index.html"}


@cache
def index() -> str:
    """HTML text of the page, with the scripts of its panels, and the start script last."""
    panels = sorted(name for name in files() if name.startswith("panel_") and name.endswith(".js"))
    tags = "\n".join(f'<script type="module" src="/page/{name}"></script>' for name in (*panels, LAST))
    return (PAGE / "index.html").read_text(encoding="utf-8").replace(SCRIPTS, tags)


VERDICT_FILES = {"report.html": "attachment", "residuals.svg": "inline"}
"""Files of a verdict that the page may fetch, and whether the browser shows or saves them."""
MESSAGE_BYTES = 4096
# Largest number of browser pages, each of which takes a share of a core, and of connections, which also fetch files.
PAGES_AT_ONCE, CONNECTIONS_AT_ONCE = 32, 128
DOOR = ".live_page.html"
SERVING = "Serving the page"
# Numbers of the frames whose pictures a saved page contains.
FRAMES = re.compile(r"\d{1,9}(,\d{1,9}){0,40}")


def bound(host: str, port: int) -> socket.socket:
    """Bind a socket to the address at which the browser page is served.

    Raises
    ------
    ProcessError, UsageError
        The port is in use, or the address is not of this machine.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        # With its protocol stated, asyncio lets a connection's answers leave at once; they waited 40 ms for each other.
        listening = socket.socket(family, kind, protocol)
    except OSError as error:
        raise UsageError(f"--host must be an address of this machine, but is {host} ({error.strerror}).") from error
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(address)
        listening.listen()  # the address is shown before the server runs; early connections wait in the backlog
    except OSError as error:
        listening.close()
        if error.errno == errno.EADDRNOTAVAIL:
            raise UsageError(f"--host must be an address of this machine, but is {host}.") from error
        raise ProcessError(
            f"The page cannot be served at {host} port {port} ({error.strerror}): another live view may use this "
            f"port; end that live view, or choose another port with --port (0 takes any free one)."
        ) from error
    return listening


class Page:
    """Serves one live view or recording to browser pages.

    Parameters
    ----------
    view : View
        The live measurement or recording that is shown.
    listening : socket.socket
        Bound socket, from `bound`.
    way : Access, optional
        Settings for access to the page.
    """

    def __init__(self, view: View, listening: socket.socket, way: Access | None = None) -> None:
        way = way or Access()
        # Modules of the requests are loaded now, because loading during the measurement would delay all threads.
        modules()
        self._view, self._listening = view, listening
        self._sockets: set[PageSocket] = set()
        self._pen = Pen()
        self._steps: list[tuple[str, bytes]] = []
        port = listening.getsockname()[1]
        tokens = {kept_token(view.out): WRITER, kept_token(view.out, VIEWER_FILE): VIEWER}
        named = socket.gethostname() if way.host in EVERYWHERE else way.host
        shown = f"[{named}]" if ":" in named else named
        self.address, self.viewer_address = (f"{way.scheme}://{shown}:{port}/?token={token}" for token in tokens)
        app = Starlette(
            routes=[
                Route("/", self._index),
                Route("/page/{name}", self._file),
                Route("/gaps.csv", self._gaps),
                Route("/gauges.csv", self._gauges),
                Route("/steps/{number}.png", self._step),
                Route("/verdict/{name}", self._verdict),
                Route("/second.jpg", self._second),
                Route("/saved.html", self._saved),
                WebSocketRoute("/socket", self._socket),
            ],
            exception_handlers={Exception: self._failed},
        )
        self._server = uvicorn.Server(
            uvicorn.Config(
                Guard(app, way.host, port, tokens, way.password, way.scheme),
                ssl_certfile=way.certificate,
                ssl_keyfile=way.key,
                http=PatientProtocol,
                ws="websockets-sansio",
                ws_max_size=MESSAGE_BYTES,
                ws_per_message_deflate=False,
                limit_concurrency=CONNECTIONS_AT_ONCE,
                timeout_graceful_shutdown=2,
                lifespan="off",
                log_level="critical",
                access_log=False,
                server_header=False,
            )
        )

    def door(self) -> Path:
        """Write a local HTML file that redirects to the address with its token, readable only by this user."""
        path = self._view.out.resolve() / DOOR
        with out_folder(self._view.out):
            path.unlink(missing_ok=True)
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(f'<!doctype html><meta http-equiv="refresh" content="0;url={html.escape(self.address)}">')
        return path

    def serve(self, until: Event) -> None:
        """Serve browser pages until the event `until` is set."""
        thread = self._view.supervisor.start(SERVING, self._run)
        while not until.wait(0.2) and thread.is_alive():
            pass
        for page in tuple(self._sockets):
            page.ending = True
        self._server.should_exit = True
        thread.join(5.0)
        self._listening.close()

    def _run(self) -> None:
        asyncio.run(self._server.serve(sockets=[self._listening]))

    async def _failed(self, request: Request, error: Exception) -> Response:
        words = sentence(f"The request {request.url.path}", error)
        self._view.supervisor.alarm(SERVING, words)
        return PlainTextResponse(words, 500)

    async def _index(self, request: Request) -> Response:
        return HTMLResponse(index())

    async def _file(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in files():
            return PlainTextResponse("There is no such file.", 404)
        return Response(files()[name], media_type=guess_type(name)[0])

    async def _gaps(self, request: Request) -> Response:
        try:
            path = await asyncio.to_thread(save_gaps, self._view)
        except FingervisionError as error:
            return PlainTextResponse(str(error), 500)
        return FileResponse(path, media_type="text/csv", filename="gaps.csv")

    async def _gauges(self, request: Request) -> Response:
        try:
            path = await asyncio.to_thread(save_gauges, self._view)
        except FingervisionError as error:
            return PlainTextResponse(str(error), 500)
        return FileResponse(path, media_type="text/csv", filename="gauges.csv")

    async def _step(self, request: Request) -> Response:
        pictures = {str(number): picture for number, (_, picture) in enumerate(self._steps)}
        picture = pictures.get(request.path_params["number"])
        if picture is None:
            return PlainTextResponse("There is no such picture: ask for the steps first.", 404)
        return Response(picture, media_type="image/png")

    async def _verdict(self, request: Request) -> Response:
        """Send a file of the newest verdict; the report contains scripts, and is saved instead of opened here."""
        name = request.path_params["name"]
        comparison: Comparison | None = self._view.features.get(MODEL)
        found = None if comparison is None else comparison.verdicts.newest
        path = None if found is None else Path(found.report).parent / name
        if name not in VERDICT_FILES or path is None or not path.is_file():
            return PlainTextResponse("There is no such file of a verdict.", 404)
        return FileResponse(path, filename=name, content_disposition_type=VERDICT_FILES[name])

    async def _second(self, request: Request) -> Response:
        """Send the newest picture of the second recording."""
        second = self._view.features.get(SECOND)
        if second is None or second.seen is None:
            return PlainTextResponse("There is no picture of a second recording.", 404)
        return Response(await asyncio.to_thread(coded, second.seen), media_type="image/jpeg")

    async def _saved(self, request: Request) -> Response:
        """Send the page of a recording as one file, with the pictures of the frames that are asked for."""
        view, asked = self._view, request.query_params.get("frames", "")
        if not isinstance(view, Playback) or not FRAMES.fullmatch(asked):
            return PlainTextResponse("There is no recording whose page could be saved with these frames.", 404)
        if request.scope.get("role") != WRITER:  # the recording is moved from frame to frame
            return PlainTextResponse(ONLY_LOOKS, 403)
        frames = sorted({min(int(frame), view.frame_count - 1) for frame in asked.split(",")})
        try:
            text = await asyncio.to_thread(page_file, view, frames, PAGE)
        except FingervisionError as error:
            return PlainTextResponse(str(error), 500)
        return HTMLResponse(text, headers={"Content-Disposition": 'attachment; filename="fingervision.html"'})

    async def _socket(self, page: WebSocket) -> None:
        if len(self._sockets) >= PAGES_AT_ONCE:
            await page.accept()  # the reason for closing can only be sent after the connection is accepted
            await page.close(
                TRY_AGAIN_LATER, f"At most {PAGES_AT_ONCE} browser pages may be open at once: close a page."
            )
            return
        socket_of_page = PageSocket(page, self._view, self._pen, self._steps)
        self._sockets.add(socket_of_page)
        try:
            await socket_of_page.serve()
        finally:
            self._sockets.discard(socket_of_page)
