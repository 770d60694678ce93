"""A conversation in lines of text over a port: questions with their replies, refusals at any time, stops at once."""

import re
from collections.abc import Mapping
from contextlib import suppress
from time import monotonic, sleep
from typing import Any

from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError, in_a_line
from fingervision.testbed.serial_port import opened_port, told
from fingervision.testbed.text_protocol.words import Exchange, Words, filled

KEYS = ("words", "port", "baud", "set")
IDENTITY = "identity"
TRIES, LATE_S, CLOSES_S = 2, 0.1, 0.5
"""A question is asked again once, because one line in a noisy cable may be spoilt; a command never is."""


class SerialPort:
    """A serial port by its name (`/dev/ttyUSB0`, `COM3`), or a pyserial address such as `socket://host:port`."""

    def __init__(self, name: str, baud: int, options: Mapping[str, Any]) -> None:
        self._port = opened_port(name, baud, 0.0, **options)
        self.rest = b""
        """What came without the end of a line."""

    def write(self, data: bytes) -> None:
        """Send bytes."""
        told(self._port, data)

    def line(self, end: bytes, within_s: float) -> bytes:
        """Return the next line with its end, or an incomplete line when the time is over."""
        until_s = monotonic() + within_s
        while end not in self.rest:
            self._port.timeout = max(0.0, min(0.05, until_s - monotonic()))
            got = self._port.read(max(1, self._port.in_waiting))
            self.rest += got
            if not got and monotonic() >= until_s:
                return b""
        line, _, self.rest = self.rest.partition(end)
        return line + end

    def close(self) -> None:
        """Release the port once it is quiet: a connection closed over unread answers discards what was said last."""
        until_s, self._port.timeout = monotonic() + CLOSES_S, LATE_S
        try:
            while self._port.read(max(1, self._port.in_waiting)) and monotonic() < until_s:
                pass
        finally:
            self._port.close()


class VisaPort:
    """A VISA resource such as `GPIB0::1::INSTR` or `TCPIP::192.168.1.5::INSTR`; needs the extra `visa`."""

    rest = b""

    def __init__(self, name: str, baud: int | None) -> None:
        import pyvisa

        # A backend other than the default follows: `...::INSTR@py`, or `...::INSTR@instruments.yaml@sim`.
        resource, at, backend = name.partition("@")
        self._manager: Any = pyvisa.ResourceManager(backend if "@" in backend else at + backend)
        speed: dict[str, Any] = {} if baud is None else {"baud_rate": baud}
        self._port: Any = self._manager.open_resource(resource, **speed)

    def write(self, data: bytes) -> object:
        """Send bytes."""
        return self._port.write_raw(data)

    def line(self, end: bytes, within_s: float) -> bytes:
        """Return the next message; VISA has no way to look whether one is there, so that 0 s returns none."""
        if within_s <= 0.0:
            return b""
        self._port.timeout = 1e3 * within_s
        self._port.read_termination = end.decode("latin-1")
        try:
            return bytes(self._port.read_raw())
        except Exception as error:
            if "TMO" in str(error) or "timeout" in str(error).lower():
                return b""
            raise

    def close(self) -> None:
        """Release the resource."""
        self._port.close()
        self._manager.close()


class Line:
    """The conversation with one instrument.

    Parameters
    ----------
    port : SerialPort or VisaPort
        The open port.
    words : Words
        The words of the instrument.
    """

    def __init__(self, port: SerialPort | VisaPort, words: Words) -> None:
        self._port, self._words, self._settings = port, words, dict(words.settings)
        self._said = ""  # the last words, which a refusal refers to
        kept = [str(each.more.get("keep", "")) for each in words.opening]
        for name in kept:
            self._settings.pop(name, None)
        try:
            sleep(words.open_s)
            for each, name in zip(words.opening, kept, strict=True):
                found = self.do(each, {})
                if found is not None and name:
                    self._settings[name] = found[1]
        except BaseException:
            with suppress(Exception):
                self.close()
            raise

    def do(self, exchange: Exchange, values: Mapping[str, str | float]) -> re.Match[str] | None:
        """Say the lines of an exchange, and await the reply to each; return the last reply.

        Raises
        ------
        RefusedError
            The instrument refused.
        DeviceError
            No reply, or none that was expected.
        """
        found = None
        for text in exchange.say:
            self.hear()
            self._said = filled(text, self._all(values)).strip()
            self.say(text, exchange, values)
            found = None if exchange.reply is None else self._reply(exchange, filled(text, self._all(values)))
        return found

    def ask(self, exchange: Exchange, values: Mapping[str, str | float] | None = None) -> re.Match[str]:
        """Ask a question, once more if its reply was spoilt, and return the reply; without words, await the next line.

        Raises
        ------
        RefusedError, DeviceError
            As for `do`.
        """
        for attempt in range(TRIES):
            try:
                found = self.do(exchange, values or {}) if exchange.say else self._reply(exchange, "nothing")
            except DeviceError:
                if attempt == TRIES - 1:
                    raise
            else:
                # The answer to the first question may follow; it must not be taken for that to the next one.
                while attempt and exchange.say and self._heard(LATE_S):
                    pass
                if found is not None:
                    return found
        raise DeviceError(
            f"{self._words.name} must have a reply in its words for {exchange.say}, but has none: add it."
        )

    def say(self, text: str, exchange: Exchange, values: Mapping[str, str | float]) -> None:
        """Send a text without waiting for anything: a stop may come from any thread, during any question."""
        self._port.write((filled(text, self._all(values)) + exchange.end).encode("latin-1"))

    def hear(self, awaited: re.Pattern[str] | None = None) -> bool:
        """Hear the lines that have come unasked; return whether one is awaited.

        Raises
        ------
        RefusedError
            One of the lines is a refusal.
        """
        found = False
        while line := self._heard(0.0):
            found |= awaited is not None and bool(awaited.search(line))
        return found

    def close(self) -> None:
        """Say the last words, and release the port; words that give back what was never read are not said."""
        try:
            for exchange in (each for name, each in self._words.actions.items() if name == "close"):
                for text in exchange.say:
                    with suppress(KeyError):
                        self.say(text, exchange, {})
        finally:
            self._port.close()

    @property
    def identity(self) -> str:
        """What tells this instrument from others of its kind, such as a serial number; empty if its words keep none."""
        return str(self._settings.get(IDENTITY, ""))

    def _all(self, values: Mapping[str, str | float]) -> dict[str, str | float]:
        return {**self._settings, **values}

    def _reply(self, exchange: Exchange, said: str) -> re.Match[str]:
        until_s, others = monotonic() + exchange.within_s, []
        awaited, found = exchange.reply, None
        while awaited is not None and (left_s := until_s - monotonic()) > 0.0:
            line = self._heard(left_s)
            if not line:
                continue
            if (seen := awaited.search(line)) is None:
                others.append(line)
                continue
            if found is not None or exchange.done is None:
                return found or seen
            awaited, found = exchange.done, seen
        got, rest = ", ".join(repr(each) for each in others[-3:]), self._port.rest.decode("latin-1")
        but = f"answered {got}" if got else "did not answer"
        if rest and not got:
            but = f"sent {rest!r}, which does not end in {self._words.answer_end!r},"
        must = exchange.more.get("must", f"answer {said.strip()!r} by '{exchange.reply and exchange.reply.pattern}'")
        raise DeviceError(
            f"{self._words.name} must {must}, but {but} within {exchange.within_s:g} s: check its cable, baud rate, "
            "and in its words reply, line_end and answer_end."
        )

    def _heard(self, within_s: float) -> str:
        end = self._words.answer_end
        line = self._port.line(end.encode("latin-1"), within_s).decode("latin-1").removesuffix(end).strip()
        refusal = self._words.refusal
        if line and refusal is not None and (found := refusal.search(line)):
            code = found[1] if refusal.groups and found[1] else line
            raise RefusedError("refused", f"{code} (it answered {line!r} to {self._said!r})" if self._said else code)
        return line


def opened_line(section: Section, words: Words) -> Line:
    """Open the port that a section states, and begin the conversation.

    Raises
    ------
    DataError, DeviceError
        The port cannot be opened, or the instrument does not answer as its words say.
    """
    name = section.word("port")
    try:
        if "::" in name:
            port: SerialPort | VisaPort = VisaPort(
                name, words.baud if name.startswith("ASRL") and "baud" in section.values else None
            )
        else:
            port = SerialPort(name, words.baud, words.serial)
    except DeviceError as error:
        section.refuse("port", f"must be that of {words.name}, but was not opened. {error}")
    except ImportError as error:
        section.refuse("port", f"is a VISA resource, which needs pyvisa ({error}): pip install 'fingervision[visa]'.")
    except Exception as error:  # each VISA library raises exceptions of its own classes
        section.refuse("port", f"must be that of {words.name}, but {name} could not be opened ({in_a_line(error)}).")
    try:
        return Line(port, words)
    except FingervisionError:
        raise
    except Exception as error:  # a refusal, or one of those above
        raise DeviceError(
            f"{words.name} at {name} must accept its first words, but did not ({in_a_line(error)}): check its cable."
        ) from error
