"""A measured quantity of an instrument that talks in lines of text: read continuously, in a thread of its own."""

from collections import deque
from threading import Condition, Thread

from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.motion.move_limits import ENDLESS_N
from fingervision.testbed.text_protocol import line
from fingervision.testbed.text_protocol.line import Line, opened_line
from fingervision.testbed.text_protocol.words import Words, number_in, words_of

KEYS = (*line.KEYS, "scale", "zero", "patience_s")
# Values that are kept until they are fetched: more than a second of the fastest serial line.
MOST = 4000
PATIENCE_S = 2.0


class TextSensor:
    """Reads an instrument's value again and again, so that a slow instrument does not slow down the camera.

    Parameters
    ----------
    conversation : Line
        The conversation, after its first words.
    words : Words
        The words of the instrument; without words to say, it sends its values unasked.
    name : str
        Name of the instrument, for run.json and errors.
    scale, zero : float
        The quantity is scale x (number - zero).
    patience_s : float
        Time without a value after which the instrument counts as failed.
    clock : Clock
        Clock of the test bed.
    """

    def __init__(
        self, conversation: Line, words: Words, name: str, scale: float, zero: float, patience_s: float, clock: Clock
    ) -> None:
        self.name, self.full_scale_n = name, ENDLESS_N
        self._talk, self._asks, self._clock = conversation, words.actions["value"], clock
        self._scale, self._zero, self._patience_s = scale, zero, patience_s
        self._new: deque[Reading] = deque(maxlen=MOST)
        self._changed, self._failed, self._closed = Condition(), "", False
        self._heard_s = clock.now_s()
        self._thread = Thread(target=self._read, name=name, daemon=True)
        self._thread.start()

    def samples(self, wait_s: float = 0.0) -> tuple[Reading, ...]:
        """Values since the last call, the oldest first; wait for at least one up to a time.

        Raises
        ------
        DeviceError
            The instrument has failed, or has sent no value for its patience.
        """
        with self._changed:
            if wait_s:
                self._changed.wait_for(lambda: self._new or self._failed, wait_s)
            samples = tuple(self._new)
            self._new.clear()
            silent_s = self._clock.now_s() - self._heard_s
            if not samples and (self._failed or silent_s > self._patience_s):
                why = self._failed or f"has sent none for {silent_s:.2g} s"
                raise DeviceError(f"{self.name} must send values while the test bed works, but {why}: check its cable.")
        return samples

    def readings(self) -> tuple[Reading, ...]:
        """Values since the last call, at least one: a force that is monitored must be new."""
        return self.samples(self._patience_s) or self.samples()

    def close(self) -> None:
        """End the thread, and release the port; closing twice is allowed."""
        if not self._closed:
            self._closed = True
            self._thread.join(self._asks.within_s + 1.0)
            self._talk.close()

    def _read(self) -> None:
        failed = ""
        while not failed and not self._closed:
            asked_s = self._clock.now_s() if self._asks.say else self._heard_s
            try:
                number = number_in(self._talk.ask(self._asks), self.name)
            except (FingervisionError, RefusedError) as error:
                failed = f"failed ({error})"
            except Exception as error:  # serial ports and VISA raise exceptions of their own classes
                failed = f"cannot be read ({type(error).__name__}: {error})"
            with self._changed:
                self._failed = failed
                if not failed:
                    self._heard_s = got_s = self._clock.now_s()
                    at_s = 0.5 * (asked_s + got_s) if self._asks.say else got_s
                    self._new.append(Reading(at_s, asked_s, got_s, self._scale * (number - self._zero)))
                self._changed.notify_all()


def opened_sensor(section: Section, context: BuildContext) -> TextSensor:
    """Open the instrument that a section states."""
    words = words_of(section, context.folder, ("value",))
    scale = section.number("scale", float(words.actions["value"].more.get("scale", 1.0)))
    zero, patience_s = section.number("zero", 0.0), section.number("patience_s", PATIENCE_S, above=0.0)
    name = f"{words.name} at {section.word('port')}"
    return TextSensor(opened_line(section, words), words, name, scale, zero, patience_s, context.clock)
