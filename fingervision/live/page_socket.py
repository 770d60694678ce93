"""WebSocket of one browser page: it sends a new state once the page has received the previous state.

Requests from the browser page are checked and counted.
"""

import asyncio
import contextlib
import json
from collections import deque
from time import monotonic
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from fingervision.domain.errors import FingervisionError, StateError
from fingervision.live.commands import Answer, harmless, obey
from fingervision.live.commands.asking import QuestionError
from fingervision.live.frame_measurement import Seen
from fingervision.live.guard import POLICY_VIOLATION, WRITER
from fingervision.live.page_words import page_json
from fingervision.live.pen import Pen
from fingervision.live.preview import Known, message, state_has_changed
from fingervision.live.supervisor import sentence
from fingervision.live.view import View

MESSAGES_A_SECOND, MOST_DIGITS = 120, 12
TRY_AGAIN_LATER, UNSUPPORTED_DATA = 1013, 1003
# Largest length of the reason with which a WebSocket is closed (RFC 6455, section 5.5: 123 bytes).
MOST_OF_REASON = 100
# Errors of a connection that its browser has ended.
GONE = (WebSocketDisconnect, TimeoutError, OSError, RuntimeError)
# Shortest time between two pictures: of 25 a second every second one, which eyes follow at half the processor time.
# Longest time between two states without a new picture, and time between two looks for a new one.
PREVIEW_EVERY_S, STATE_EVERY_S, LOOK_EVERY_S = 0.06, 0.2, 0.01
# Time between two pictures while the measurement or the disk is too slow.
PREVIEW_IN_A_HURRY_EVERY_S = 0.5
# The connection of a page that does not acknowledge a state within this time is closed.
ACKNOWLEDGED_WITHIN_S = 20.0
ONLY_LOOKS = "With this address you can only watch: ask whoever started the live view for the address that controls it."
TAKE_OVER, SENDING = "take_over", "Sending to a page"


class PageSocket:
    """Serves one browser page until either side closes the connection.

    Parameters
    ----------
    page : WebSocket
        WebSocket connection of the page, not yet accepted.
    view : View
        The live measurement or recording that is shown.
    pen : Pen
        Administration of write access.
    steps : list
        List to which requested pictures of the measuring steps are appended.
    """

    def __init__(self, page: WebSocket, view: View, pen: Pen, steps: list[tuple[str, bytes]]) -> None:
        self._page, self._view, self._pen, self._steps = page, view, pen, steps
        self._is_viewer = page.scope.get("role") != WRITER
        self._acknowledged = asyncio.Event()
        self.ending = False

    async def serve(self) -> None:
        """Send states and receive requests.

        If sending or receiving fails, the connection is closed; a page that is still open connects again.
        """
        page = self._page
        await page.accept()
        tasks = [asyncio.create_task(self._send()), asyncio.create_task(self._receive())]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._pen.let_go(self)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        failed = next((error for task in done if (error := task.exception()) is not None), None)
        if failed is not None and not isinstance(failed, WebSocketDisconnect):
            why = "The browser page did not acknowledge the last picture."
            if not isinstance(failed, GONE):
                why = sentence(SENDING, failed)
                self._view.supervisor.alarm(SENDING, why)
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await page.close(TRY_AGAIN_LATER, why[:MOST_OF_REASON])

    def _about(self) -> dict[str, Any]:
        return {"viewer": self._is_viewer, "holds_pen": not self._is_viewer and self._pen.may_write(self)}

    async def _send(self) -> None:
        """Send the newest state, then wait until the page has received it, so that states do not queue up."""
        view, known = self._view, known_by(self._page)
        shown: Seen | None = None
        pictured_s = float("-inf")
        while not self.ending:
            asked_s = monotonic()
            while view.seen is shown and monotonic() - asked_s < STATE_EVERY_S:
                await asyncio.sleep(LOOK_EVERY_S)
            seen = view.seen
            every_s = PREVIEW_IN_A_HURRY_EVERY_S if view.in_a_hurry else 0.0
            picture = seen if seen is not shown and monotonic() - pictured_s >= every_s else None
            if picture is not None:
                pictured_s = monotonic()
            following = await asyncio.to_thread(message, view, known, picture, self._about())
            known = following.known
            shown = seen
            self._acknowledged.clear()
            await self._page.send_bytes(following.content)
            await asyncio.wait_for(self._acknowledged.wait(), ACKNOWLEDGED_WITHIN_S)
            await asyncio.sleep(max(0.0, PREVIEW_EVERY_S - (monotonic() - asked_s)))
        await self._page.close(1012, "The live view has ended.")

    async def _receive(self) -> None:
        received_s: deque[float] = deque(maxlen=MESSAGES_A_SECOND)
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                received = await self._page.receive()
                if received["type"] == "websocket.disconnect":
                    return
                text = received.get("text")
                if text is None:
                    await self._page.close(UNSUPPORTED_DATA, "A message of the page must be text, but is binary.")
                    return
                if len(received_s) == MESSAGES_A_SECOND and monotonic() - received_s[0] < 1.0:
                    await self._page.close(
                        POLICY_VIOLATION, f"A page may send at most {MESSAGES_A_SECOND} messages per second."
                    )
                    return
                received_s.append(monotonic())
                request = request_of(text)
                if request.get("do") == "ack":
                    self._acknowledged.set()
                else:
                    await self._page.send_text(page_json(await self._answer(request)))

    def _may_write(self, takes_over: bool) -> None:
        if self._is_viewer:
            raise StateError(ONLY_LOOKS)
        if takes_over:
            self._pen.take(self)
            self._view.say("pen", "Another browser page controls the live view from now on.")
        self._pen.write(self)

    async def _answer(self, request: dict[str, Any]) -> dict[str, Any]:
        name = request.get("do")
        answer = Answer()
        refused: dict[str, Any] = {}
        part = f"The request {str(name)[:40]}"
        try:
            if not (isinstance(name, str) and name in harmless()):
                self._may_write(name == TAKE_OVER)
            if name == TAKE_OVER:
                return {"words": "", "do": name}
            answer = await asyncio.to_thread(obey, self._view, request)
            self._view.supervisor.clear(part)
        except QuestionError as error:
            refused = {"question": str(error), "request": {**request, "sure": True}}
        except FingervisionError as error:
            refused = {"refused": str(error), "field": getattr(error, "field", None)}
        except Exception as error:  # the request is answered, and the connection of the page remains
            refused = {"refused": sentence(part, error)}
            self._view.supervisor.alarm(part, refused["refused"])
        finally:
            state_has_changed()
        if refused:
            return {**refused, "do": str(name)[:40]}
        if answer.pictures:
            self._steps[:] = answer.pictures
        steps = [title for title, _ in answer.pictures]
        return {**answer.more, "words": answer.words, "steps": steps, "do": name}


def known_by(page: WebSocket) -> Known:
    """Numbers of the rows and messages that a reconnecting page already has; an invalid number counts as zero."""
    asked = page.query_params
    numbers = [asked.get(name, "") for name in ("rows", "messages")]
    if not all(number.isascii() and number.isdigit() and len(number) <= MOST_DIGITS for number in numbers):
        return Known()
    rows, messages = (int(number) for number in numbers)
    return Known(asked.get("view", ""), rows, messages)


def request_of(text: str) -> dict[str, Any]:
    """Parse a message as a request; an invalid message becomes an empty request."""
    try:
        request = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return request if isinstance(request, dict) else {}
