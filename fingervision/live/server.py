"""The page's server: files of the page, a socket for the live view, the gaps as a file. Bound to loopback."""

import asyncio
import contextlib
import errno
import html
import json
import os
import socket
from collections import deque
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from fingervision.domain.errors import FingervisionError, UsageError
from fingervision.live.commands import Answer, obey
from fingervision.live.frame_measurement import Seen
from fingervision.live.guard import EVERYWHERE, POLICY_VIOLATION, Guard
from fingervision.live.half_open import PatientProtocol
from fingervision.live.page_files import PAGE, files, index
from fingervision.live.page_token import kept_token
from fingervision.live.preview import Known, message
from fingervision.live.promptness import be_prompt
from fingervision.live.save_gaps import save_gaps
from fingervision.live.view import View
from fingervision.storage.out_folder import out_folder

MESSAGE_BYTES, MESSAGES_A_SECOND, PAGES_AT_ONCE = 4096, 120, 4
MOST_DIGITS = 12
DOOR = ".live_page.html"
TRY_AGAIN_LATER = 1013
# The preview is as fast as a screen needs it; without a new picture the page hears of the state so often.
PREVIEW_EVERY_S, STATE_EVERY_S, LOOK_EVERY_S = 0.03, 0.2, 0.01
# When measuring or the disk lags, a picture now and then must do.
PREVIEW_IN_A_HURRY_EVERY_S = 0.5
# A page that does not acknowledge is gone.
ACKNOWLEDGED_WITHIN_S = 20.0


def bound(host: str, port: int) -> socket.socket:
    """Bind the address that the page is served at.

    Raises
    ------
    FingervisionError
        The port is in use, or the address is not of this machine.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, socket.SOCK_STREAM)
    except OSError as error:
        raise UsageError(f"--host must be an address of this machine, but is {host} ({error.strerror}).") from error
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(address)
        listening.listen()  # the address is told before the server is quite up: who comes early waits
    except OSError as error:
        listening.close()
        if error.errno == errno.EADDRNOTAVAIL:
            raise UsageError(f"--host must be an address of this machine, but is {host}.") from error
        raise FingervisionError(
            f"The page cannot be served at {host} port {port} ({error.strerror}): another live view may run there; end "
            "it, or choose another port with --port (0 takes any free one)."
        ) from error
    return listening


class Page:
    """Serves one session.

    Parameters
    ----------
    session : View
        What is shown.
    listening : socket.socket
        See `bound`.
    host : str
        The address as the user named it.
    """

    def __init__(self, session: View, listening: socket.socket, host: str) -> None:
        self._session, self._listening = session, listening
        self._pages = 0
        self._steps: tuple[tuple[str, bytes], ...] = ()
        self._ending = False
        port = listening.getsockname()[1]
        token = kept_token(session.out)
        named = socket.gethostname() if host in EVERYWHERE else host
        shown = f"[{named}]" if ":" in named else named
        self.address = f"http://{shown}:{port}/?token={token}"
        app = Starlette(
            routes=[
                Route("/", self._index),
                Route("/page/{name}", self._file),
                Route("/gaps.csv", self._gaps),
                Route("/steps/{number}.png", self._step),
                WebSocketRoute("/socket", self._socket),
            ]
        )
        self._server = uvicorn.Server(
            uvicorn.Config(
                Guard(app, host, port, token),
                http=PatientProtocol,
                ws="websockets-sansio",
                ws_max_size=MESSAGE_BYTES,
                ws_per_message_deflate=False,
                limit_concurrency=64,
                timeout_graceful_shutdown=2,
                lifespan="off",
                log_level="critical",
                access_log=False,
                server_header=False,
            )
        )

    def door(self) -> Path:
        """Write a page that only this user can read, and that leads to the address."""
        path = self._session.out.resolve() / DOOR
        with out_folder(self._session.out):
            path.unlink(missing_ok=True)
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(f'<!doctype html><meta http-equiv="refresh" content="0;url={html.escape(self.address)}">')
        return path

    def serve(self, until: Event) -> None:
        """Serve until told to end."""
        thread = Thread(target=self._run, name="page", daemon=True)
        thread.start()
        while not until.wait(0.2) and thread.is_alive():
            pass
        self._ending = True
        self._server.should_exit = True
        thread.join(5.0)
        self._listening.close()

    def _run(self) -> None:
        be_prompt()
        asyncio.run(self._server.serve(sockets=[self._listening]))

    async def _index(self, request: Request) -> Response:
        return HTMLResponse(index())

    async def _file(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in files():
            return PlainTextResponse("There is no such file.", 404)
        return FileResponse(PAGE / name)

    async def _gaps(self, request: Request) -> Response:
        try:
            path = await asyncio.to_thread(save_gaps, self._session)
        except FingervisionError as error:
            return PlainTextResponse(str(error), 500)
        return FileResponse(path, media_type="text/csv", filename="gaps.csv")

    async def _step(self, request: Request) -> Response:
        pictures = {str(number): picture for number, (_, picture) in enumerate(self._steps)}
        picture = pictures.get(request.path_params["number"])
        if picture is None:
            return PlainTextResponse("There is no such picture: ask for the steps first.", 404)
        return Response(picture, media_type="image/png")

    async def _socket(self, page: WebSocket) -> None:
        if self._pages >= PAGES_AT_ONCE:
            await page.close(TRY_AGAIN_LATER, f"At most {PAGES_AT_ONCE} pages may look at once: close one.")
            return
        self._pages += 1
        try:
            await page.accept()
            acknowledged = asyncio.Event()
            tasks = [asyncio.create_task(self._send(page, acknowledged))]
            tasks.append(asyncio.create_task(self._receive(page, acknowledged)))
            try:
                # When either ends, however it ends, the page is let go, and connects anew if it is still there.
                done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
            failed = next((error for task in done if (error := task.exception()) is not None), None)
            if failed is not None and not isinstance(failed, WebSocketDisconnect):
                silent = isinstance(failed, TimeoutError)
                why = "The page did not answer." if silent else f"Sending failed ({type(failed).__name__})."
                if not silent:
                    self._session.say("page", f"{why} The page connects again.")
                with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                    await page.close(TRY_AGAIN_LATER, why)
        finally:
            self._pages -= 1

    async def _send(self, page: WebSocket, acknowledged: asyncio.Event) -> None:
        """Send the newest, then wait until the page has it: nothing ever queues up."""
        session = self._session
        known = _known(page)
        shown: Seen | None = None
        pictured_s = float("-inf")
        while not self._ending:
            asked_s = monotonic()
            while monotonic() - asked_s < STATE_EVERY_S and session.seen is shown:
                await asyncio.sleep(LOOK_EVERY_S)
            seen = session.seen
            every_s = PREVIEW_IN_A_HURRY_EVERY_S if session.in_a_hurry else 0.0
            picture = seen if seen is not shown and monotonic() - pictured_s >= every_s else None
            if picture is not None:
                pictured_s = monotonic()
            following = await asyncio.to_thread(message, session, known, picture)
            known = following.known
            shown = seen
            acknowledged.clear()
            await page.send_bytes(following.content)
            await asyncio.wait_for(acknowledged.wait(), ACKNOWLEDGED_WITHIN_S)
            await asyncio.sleep(max(0.0, PREVIEW_EVERY_S - (monotonic() - asked_s)))
        await page.close(1012, "The live view has ended.")

    async def _receive(self, page: WebSocket, acknowledged: asyncio.Event) -> None:
        received_s: deque[float] = deque(maxlen=MESSAGES_A_SECOND)
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                text = await page.receive_text()
                if len(received_s) == MESSAGES_A_SECOND and monotonic() - received_s[0] < 1.0:
                    await page.close(POLICY_VIOLATION, f"At most {MESSAGES_A_SECOND} messages a second.")
                    return
                received_s.append(monotonic())
                request = _request(text)
                if request.get("do") == "ack":
                    acknowledged.set()
                else:
                    await page.send_text(json.dumps(await self._answer(request)))

    async def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            answer: Answer = await asyncio.to_thread(obey, self._session, request)
        except FingervisionError as error:
            return {"refused": str(error), "do": str(request.get("do"))[:40]}
        if answer.pictures:
            self._steps = answer.pictures
        steps = [name for name, _ in answer.pictures]
        return {**answer.more, "words": answer.words, "steps": steps, "do": request.get("do")}


def _known(page: WebSocket) -> Known:
    """What a page that comes back has; numbers that are none count as nothing."""
    asked = page.query_params
    numbers = [asked.get(name, "") for name in ("rows", "messages")]
    if not all(number.isascii() and number.isdigit() and len(number) <= MOST_DIGITS for number in numbers):
        return Known()
    return Known(asked.get("view", ""), *(int(number) for number in numbers))


def _request(text: str) -> dict[str, Any]:
    try:
        request = json.loads(text)
    except ValueError:
        return {}
    return request if isinstance(request, dict) else {}
