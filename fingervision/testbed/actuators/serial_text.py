"""A stage whose controller talks in lines of text, by the words of a TOML file: GRBL, Marlin, PI, SmarAct, Newport.

`words` is the name of a file in the package, or a file of one's own (`words = "./my_stage.toml"`); the manual's page on
stages explains its format. Tested against emulators written from the makers' protocols (tests/testbed/stages), not on
hardware.
"""

import re
from pathlib import Path

from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import (
    AxisSettings,
    SingleAxis,
    stated_axis,
)
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.move_limits import FreeMoves
from fingervision.testbed.text_protocol import line
from fingervision.testbed.text_protocol.line import Line, opened_line
from fingervision.testbed.text_protocol.words import Exchange, Words, number_in, words_of

__all__ = ["KEYS", "SIMULATED", "TextStage", "build", "without_hardware"]
KEYS = (*line.KEYS, *AXIS)
SIMULATED = False
NEEDED = ("position", "move", "stop")


class TextStage(SingleAxis):
    """One axis of a controller that talks in lines of text.

    Parameters
    ----------
    conversation : Line
        The conversation, after its first words.
    words : Words
        The words of the controller.
    name : str
        Name of the stage.
    clock : Clock
        Clock of the test bed.
    settings : AxisSettings
        Limits and coordinate of the stage.
    """

    def __init__(self, conversation: Line, words: Words, name: str, clock: Clock, settings: AxisSettings) -> None:
        super().__init__(name, clock, settings)
        self._talk, self._actions = conversation, words.actions
        # Reply that ends a command which the controller answers only when it is done.
        self._awaited: re.Pattern[str] | None = None
        self._last_mm = 0.0

    def _moving(self) -> bool:
        if self._awaited is not None:
            if not self._talk.hear(self._awaited):
                return True
            self._awaited = None
        busy = self._actions.get("busy")
        if busy is None:
            return not self._stands_still()
        found = self._talk.ask(busy)
        if "moving_bits" in busy.more:
            return bool(int(number_in(found, self.name)) & int(busy.more["moving_bits"]))
        said = found[1] if found.re.groups else found[0]
        return re.search(str(busy.more["moving"]), said) is not None

    def _position_mm(self) -> float:
        if self._awaited is not None:  # the controller does not listen until it is done
            return self._last_mm
        asked = self._actions["position"]
        self._last_mm = number_in(self._talk.ask(asked), self.name) / float(asked.more.get("per_mm", 1.0))
        return self._last_mm

    def _go_home(self) -> None:
        home = self._actions.get("home")
        if home is None:
            return
        if home.more.get("blocks"):
            self._talk.hear()
            for text in home.say:
                self._talk.say(text, home, {})
            self._awaited = home.reply
        else:
            self._command(home, {})

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        move = self._actions["move"]
        per_mm, per_mm_s = (float(move.more.get(key, 1.0)) for key in ("per_mm", "speed_per_mm_s"))
        self._command(move, {"to": to_mm * per_mm, "speed": speed_mm_s * per_mm_s})

    def _halt(self) -> None:
        stop, home = self._actions["stop"], self._actions.get("home")
        for text in stop.say:
            self._talk.say(text, stop, {})
        if self._awaited is not None and home is not None and "stop" in home.more:
            self._talk.say(str(home.more["stop"]), stop, {})
        self._awaited = None

    def _release(self) -> None:
        self._talk.close()

    def _command(self, exchange: Exchange, values: dict[str, str | float]) -> None:
        self._talk.do(exchange, values)
        if "check" in self._actions:
            answer = self._talk.ask(self._actions["check"])
            if answer.re.groups and answer[1]:
                raise RefusedError("refused", answer[1])


def without_hardware(section: Section, folder: Path) -> FreeMoves:
    """Limits of the stage, and a check of its words, without opening the port."""
    words_of(section, folder, NEEDED)
    return FreeMoves(stated_axis(section).limits)


def build(section: Section, context: BuildContext) -> TextStage:
    """Open the port that the configuration states, and say the first words."""
    settings, words = stated_axis(section), words_of(section, context.folder, NEEDED)
    conversation = opened_line(section, words)
    identity = f" ({conversation.identity})" if conversation.identity else ""
    name = f"{words.name}{identity} at {section.word('port')}"
    return TextStage(conversation, words, name, context.clock, settings).at_rest()
