"""The page over TLS, from the certificate to the pictures; unusable pairs of certificate and key are refused."""

import shutil
import ssl
import subprocess
from collections.abc import Iterator
from http.client import HTTPSConnection
from pathlib import Path
from threading import Event, Thread
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit
from urllib.request import urlopen

import pytest
from websockets.sync.client import connect

from calib.calibration import BareScale
from fingervision.domain.errors import InputFileError, UsageError
from fingervision.frames.source import Wish
from fingervision.live.access import access
from fingervision.live.choices import Choices
from fingervision.live.opening import opened
from fingervision.live.server import Page, bound
from fingervision.live.session import Session

OPENSSL = shutil.which("openssl")
pytestmark = pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed: it makes the certificate.")


def pair(folder: Path, name: str = "page", *more: str) -> tuple[Path, Path]:
    """Make a self-signed certificate for the loopback interface."""
    certificate, key = folder / f"{name}.pem", folder / f"{name}.key"
    command = [str(OPENSSL), "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-days", "2"]
    command += ["-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"]
    command += ["-keyout", str(key), "-out", str(certificate), *(more or ("-nodes",))]
    subprocess.run(command, check=True, capture_output=True)
    return certificate, key


@pytest.fixture
def page(tmp_path: Path) -> Iterator[tuple[Page, ssl.SSLContext]]:
    certificate, key = pair(tmp_path)
    session = Session(opened("simulated", Wish()), Choices(scale=BareScale(34.0)), tmp_path / "out")
    ending = Event()
    way = access("127.0.0.1", 0, None, certificate, key)
    found = Page(session, bound("127.0.0.1", 0), way)
    thread = Thread(target=found.serve, args=(ending,))
    thread.start()
    yield found, ssl.create_default_context(cafile=certificate)
    ending.set()
    thread.join()
    session.capture.stop()


def handshake_status(target: str, headers: dict[str, str], trusting: ssl.SSLContext) -> int:
    """HTTP status of the answer to a request for a WebSocket."""
    address = urlsplit(target)
    connection = HTTPSConnection(address.netloc, timeout=10.0, context=trusting)
    try:
        connection.request("GET", f"{address.path}?{address.query}", headers=headers)
        return connection.getresponse().status
    finally:
        connection.close()


def test_page_and_socket_are_encrypted_and_nothing_else_is_spoken(page: tuple[Page, ssl.SSLContext]) -> None:
    served, trusting = page
    assert served.address.startswith("https://127.0.0.1:")
    with urlopen(served.address, timeout=10.0, context=trusting) as answer:
        assert answer.status == 200
        # There is no cookie that could leave by plain HTTP: the token is in the address, which TLS hides.
        assert answer.headers["Set-Cookie"] is None
    origin = served.address.partition("/?")[0]
    target = served.address.replace("https://", "wss://").replace("/?", "/socket?")
    with connect(target, origin=origin, ssl=trusting, max_size=None) as socket:  # type: ignore[arg-type]
        assert len(socket.recv(timeout=20.0)) > 4
    # Asked by hand: the client above writes and reads one TLS connection from two threads, and now and then loses an
    # answer that is followed by the end of the connection.
    handshake = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "MDEyMzQ1Njc4OWFiY2RlZg==",
    }
    for page_origin, status in ((origin.replace("https", "http"), 403), (origin, 101)):
        assert handshake_status(target, {**handshake, "Origin": page_origin}, trusting) == status
    with pytest.raises((URLError, ConnectionError, OSError)):
        urlopen(served.address.replace("https", "http"), timeout=5.0)
    # Who does not know the certificate is warned by its own browser.
    with pytest.raises(URLError, match="CERTIFICATE_VERIFY_FAILED"):
        urlopen(served.address, timeout=5.0, context=ssl.create_default_context())
    with pytest.raises(HTTPError):
        urlopen(f"{origin}/", timeout=10.0, context=trusting)


def test_a_pair_that_cannot_be_used_is_a_sentence(tmp_path: Path) -> None:
    certificate, key = pair(tmp_path)
    _, other = pair(tmp_path, "other")
    _, locked = pair(tmp_path, "locked", "-passout", "pass:secret")
    (tmp_path / "none.pem").write_text("no certificate")
    (tmp_path / "empty.pem").write_bytes(b"")
    for one, two in (
        (certificate, other),
        (certificate, locked),
        (tmp_path / "none.pem", key),
        (certificate, tmp_path / "empty.pem"),
        (key, certificate),
    ):
        with pytest.raises(InputFileError, match="must be PEM files that belong together") as refused:
            access("127.0.0.1", 0, None, one, two)
        assert "\n" not in str(refused.value)
    with pytest.raises(InputFileError, match="There is no file"):
        access("127.0.0.1", 0, None, tmp_path, key)
    with pytest.raises(UsageError, match="needs both"):
        access("127.0.0.1", 0, None, certificate, None)
