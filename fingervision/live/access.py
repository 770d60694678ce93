"""Access to the browser page: tokens, password for other computers, and TLS if a certificate is given."""

import ssl
from dataclasses import dataclass
from pathlib import Path

from fingervision.domain.errors import DataError, InputFileError, UsageError
from fingervision.live.guard import LOOPBACK_NAMES
from fingervision.storage.plain_file import plain

LEAST_LETTERS = 12
"""Smallest number of characters of a password; as only one guess per second is allowed (`guard.GUESS_COSTS_S`), a
password of this length cannot be guessed.
"""
PLAIN = (
    "Other computers can reach the page, over plain HTTP: whoever can listen to the network can read the page, its "
    "token and its password. Use plain HTTP only on a separate network of the test bed or through an SSH tunnel, or "
    "give --tls-cert and --tls-key."
)
ENCRYPTED = (
    "Other computers can reach the page, over TLS: whoever has the address and the password can watch the live view."
)


@dataclass(frozen=True, slots=True)
class Access:
    """Settings that determine who can reach the browser page, and how.

    Parameters
    ----------
    host : str
        Network address to which the server is bound.
    port : int
        Port number; 0 selects any free port.
    password : str
        Password required from every user; empty for no password.
    certificate, key : Path or None
        Certificate and private key for TLS.
    """

    host: str = "127.0.0.1"
    port: int = 0
    password: str = ""
    certificate: Path | None = None
    key: Path | None = None

    @property
    def scheme(self) -> str:
        """URL scheme of the page: http or https."""
        return "http" if self.certificate is None else "https"

    @property
    def warning(self) -> str:
        """Security warning for the user; empty if the page is reachable only from this computer."""
        if self.host in LOOPBACK_NAMES:
            return ""
        return PLAIN if self.certificate is None else ENCRYPTED


def access(host: str, port: int, password_file: Path | None, certificate: Path | None, key: Path | None) -> Access:
    """Check the settings for access to the browser page.

    Raises
    ------
    UsageError
        Other computers could connect without a password, or a certificate is given without its key, or a key without
        its certificate.
    DataError, InputFileError
        A file cannot be read, or the password is too short.
    """
    if (certificate is None) != (key is None):
        raise UsageError("TLS needs both --tls-cert and --tls-key, but one is missing.")
    for file in (certificate, key):
        if file is not None and not file.is_file():
            raise InputFileError(f"There is no file {file}: give the files of the certificate and of its key.")
    if certificate is not None and key is not None:
        _check_pair(certificate, key)
    if password_file is None and host not in LOOPBACK_NAMES:
        raise UsageError(
            f"--host {host} lets other computers connect, which needs a password: write a password of at least "
            f"{LEAST_LETTERS} characters into a file, and name the file with --password-file."
        )
    return Access(host, port, "" if password_file is None else _password(password_file), certificate, key)


def _check_pair(certificate: Path, key: Path) -> None:
    """Refuse a certificate and key that the server could not use, such as a key with a password."""
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password=lambda: "")
    except (ssl.SSLError, OSError, ValueError) as error:
        why = getattr(error, "reason", None) or getattr(error, "strerror", None) or str(error)
        raise InputFileError(
            f"The certificate {certificate} and the key {key} must be PEM files that belong together, and the key "
            f"must have no password, but they cannot be used ({str(why).lower().replace('_', ' ')}): make a new pair."
        ) from error


def _password(file: Path) -> str:
    try:
        words = plain(file).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise InputFileError(f"The password cannot be read from {file}: give a text file.") from error
    if len(words) < LEAST_LETTERS:
        raise DataError(f"The password in {file} must have at least {LEAST_LETTERS} characters, but has {len(words)}.")
    return words
