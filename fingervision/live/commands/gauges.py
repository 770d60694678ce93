"""Requests about user-defined gauges: open, add, change, remove, load, save."""

from dataclasses import MISSING, fields
from math import isfinite
from typing import Any

from fingervision.domain.errors import ArgumentError, StateError, UsageError
from fingervision.domain.field import declared
from fingervision.domain.numbers import stated_number, to_number
from fingervision.gauges.kinds import kind_named, kinds
from fingervision.live.commands.asking import GREATEST, MOST_LETTERS, Answer, Request, shown, words
from fingervision.live.live_gauges import put_live_gauges
from fingervision.live.playback.gauge_board import USUAL_FILE, ChangedMeanwhileError, FieldError, GaugeBoard
from fingervision.live.playback.gauge_following import GAUGES, GaugesBeside, put_gauges_beside
from fingervision.live.playback.playback import Playback
from fingervision.live.session import Session
from fingervision.live.view import View

MOST_KEYS = 50
# Initial value of a number that a new gauge needs; this size suits most objects in a picture.
USUAL_PX = 40.0


def _beside(view: View) -> GaugesBeside:
    found = view.features.get(GAUGES)
    if isinstance(found, GaugesBeside):
        return found
    if isinstance(view, Session):
        return put_live_gauges(view, USUAL_FILE)
    if not isinstance(view, Playback):
        raise StateError("Gauges are drawn on a recording or a camera's picture, but this source is neither of them.")
    return put_gauges_beside(view, USUAL_FILE)


def _board(view: View) -> GaugeBoard:
    return _beside(view).board


def _table(request: Request, name: str, *, may_lack: bool = False) -> dict[str, Any]:
    table = request.get(name)
    if not isinstance(table, dict) or len(table) > MOST_KEYS:
        raise UsageError("A gauge must be a table of settings (name, kind, position), but is not.")
    table = {key: _value(key, value) for key, value in table.items()}
    for key, value in table.items():
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= GREATEST
        is_word = isinstance(value, str) and len(value) <= MOST_LETTERS
        if not (is_number or is_word or (may_lack and value is None)):
            raise UsageError(f"{str(key)[:40]} must be a number or a text, but is {shown(value)}.")
    return table


def _value(key: Any, value: Any) -> Any:
    """Value of a setting as typed; a text that is a number, for a setting other than the name, becomes the number."""
    if key == "name" or not isinstance(value, str) or len(value) > MOST_LETTERS:
        return value
    if all(to_number(value, mark) is None for mark in ".,"):
        return value
    try:
        return stated_number(value, str(key))
    except ArgumentError as error:
        raise FieldError(str(key), str(error)) from error


def _said(view: View, sentence: str = "") -> Answer:
    return Answer(sentence, more={"version": _board(view).version})


def _kinds(view: View, request: Request) -> Answer:
    """Return the kinds of gauges with their settings, for the browser page."""
    return Answer(more={"kinds": {name: settings_of(kind_named(name).SPEC) for name in kinds()}})


def settings_of(spec: Any) -> list[dict[str, Any]]:
    """Key, default, limits, permitted words and initial value of each setting of a kind of gauge, in order."""
    found = []
    for each, one in zip(declared(spec), fields(spec), strict=True):
        default = None if one.default is MISSING else one.default
        low, high = (limit if isfinite(limit) else None for limit in (each.field.low, each.field.high))
        first = each.field.of[0] if each.field.of else min(max(USUAL_PX, each.field.low), each.field.high)
        found.append({
            "key": each.name, "default": default, "low": low, "high": high, "choices": each.field.of,
            "usual": first if default is None else default,
        })  # fmt: skip
    return found


def _open(view: View, request: Request) -> Answer:
    _beside(view)
    return Answer()


def _add(view: View, request: Request) -> Answer:
    _board(view).add(_table(request, "table"))
    return _said(view)


def _change(view: View, request: Request) -> Answer:
    _board(view).change(words(request, "name"), _table(request, "changes", may_lack=True))
    return _said(view)


def _remove(view: View, request: Request) -> Answer:
    name = words(request, "name")
    _board(view).remove(name)
    return _said(view, f"The gauge {name} is removed here; save the gauges to remove it from the file too.")


def _load(view: View, request: Request) -> Answer:
    board = _board(view)
    board.load()
    return _said(view, f"{len(board.gauges)} gauges loaded from {board.path}.")


def _save(view: View, request: Request) -> Answer:
    board = _board(view)
    try:
        board.save(over=request.get("over") is True)
    except ChangedMeanwhileError:
        _beside(view).is_changed_meanwhile = True
        raise
    _beside(view).is_changed_meanwhile = False
    return _said(view, f"{len(board.gauges)} gauges saved to {board.path}.")


def section(view: View) -> dict[str, Any]:
    """Return the gauges and their readings in the displayed frame."""
    found = view.features.get(GAUGES)
    if not isinstance(found, GaugesBeside):
        return {"gauges": {"is_open": False} if isinstance(view, Playback | Session) else None}
    board, following = found.board, found.following
    version, tables = board.version, board.tables
    return {
        "gauges": {
            "is_open": True,
            "is_asked_for": found.is_asked_for,
            "is_live": found.is_live,
            "file": str(board.path),
            "is_saved": board.is_saved,
            "changed_meanwhile": found.is_changed_meanwhile,
            "version": version,
            "tables": [dict(table) for table in tables],
            "first": following.first or 0,
            "frames": following.frames,
            "is_whole": following.is_whole,
            "trouble": following.trouble,
            **found.readings_in(view.seen, version),
        }
    }


COMMANDS = {
    "gauge_kinds": _kinds,
    "gauges_open": _open,
    "gauge_add": _add,
    "gauge_change": _change,
    "gauge_remove": _remove,
    "gauges_load": _load,
    "gauges_save": _save,
}
HARMLESS = frozenset({"gauge_kinds"})
