"""What a page is sent: no more pictures than eyes follow, at once, and from the memory of the program."""

import json
import socket
import struct
import time
from http.client import HTTPConnection
from urllib.parse import urlsplit

from fingervision.live.page_socket import PREVIEW_EVERY_S
from fingervision.live.server import Page, files
from fingervision.live.session import Session
from tests.live.test_attacks import socket_of
from tests.waiting import until

WATCHED_S = 2.0


def test_a_page_that_acknowledges_at_once_is_sent_every_second_picture_and_all_rows(
    page: Page, session: Session
) -> None:
    session.start()
    try:
        until(lambda: session.row_count > 5)
        pictures, views = 0, dict[str, list[int]]()
        with socket_of(page.address) as looks:
            end_s = time.monotonic() + WATCHED_S
            while time.monotonic() < end_s:
                message = looks.recv(timeout=10.0)
                if isinstance(message, bytes):
                    (length,) = struct.unpack(">I", message[:4])
                    pictures += len(message) > 4 + length
                    head = json.loads(message[4 : 4 + length])
                    views.setdefault(str(head["view"]), []).extend(point[3] for point in head["points"])
                    looks.send('{"do": "ack"}')
        assert 1 < pictures <= WATCHED_S / PREVIEW_EVERY_S + 1
        # Every row comes, and once; all rows come once more when the camera has become known.
        assert len(views) <= 2
        for sent in views.values():
            assert sent == [*range(sent[0], sent[0] + len(sent))]
        assert sum(len(sent) for sent in views.values()) > pictures
    finally:
        session.stop()


def test_answers_of_a_connection_do_not_wait_for_each_other(page: Page) -> None:
    at = urlsplit(page.address)
    # Only a connection whose protocol is stated has its answers sent at once by asyncio.
    assert page._listening.proto == socket.IPPROTO_TCP
    connection = HTTPConnection(at.hostname or "", at.port or 0)
    for name, content in files().items():
        connection.request("GET", f"/page/{name}")
        answer = connection.getresponse()
        assert answer.read() == content
        kind = {"js": "javascript", "css": "css", "svg": "svg"}.get(name.rpartition(".")[2], "")
        assert kind in (answer.getheader("Content-Type") or "")
    connection.close()
