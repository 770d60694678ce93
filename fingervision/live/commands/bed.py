"""Requests to the test bed (home, move, jog, run a recipe, stop), which need the option `--allow-motion`."""

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from fingervision.domain.errors import StateError, UsageError
from fingervision.live.commands.asking import Answer, Request, file_inside, number
from fingervision.live.view import View
from fingervision.storage.recipe_toml import read_recipe

if TYPE_CHECKING:
    from fingervision.live.bed.bench import Bench

BED, MOTION = "bed", "allow_motion"
LONGEST_JOG_S = 10.0
"""Longest duration of a jog, after which it ends even if the user's button release was not received."""
READ_ONLY = "This page may only watch the test bed: whoever starts the live view can allow motions."


def _bench(view: View) -> "Bench":
    bench: Bench | None = view.features.get(BED)
    if bench is None:
        raise StateError("This live view has no test bed: start the live view of a test bed.")
    return bench


def _movable(view: View) -> "Bench":
    bench = _bench(view)
    if not view.features.get(MOTION):
        raise StateError(READ_ONLY)
    return bench


def _stop(view: View, request: Request) -> Answer:
    # A user who may not move the stage may still stop it, because anybody may see a danger.
    _bench(view).stop()
    return Answer("Stopped.")


def _home(view: View, request: Request) -> Answer:
    _movable(view).home()
    return Answer()


def _move(view: View, request: Request) -> Answer:
    bench = _movable(view)
    to_mm, speed_mm_s = number(request, "to_mm"), number(request, "speed_mm_s")
    bench.move(to_mm, speed_mm_s)
    return Answer()


def _jog(view: View, request: Request) -> Answer:
    bench = _movable(view)
    speed_mm_s, for_s = number(request, "speed_mm_s"), number(request, "for_s")
    if not 0.0 < for_s <= LONGEST_JOG_S:
        raise UsageError(f"A jog must last more than 0 s and at most {LONGEST_JOG_S:g} s, but {for_s:g} was requested.")
    bench.jog(speed_mm_s, for_s)
    return Answer()


def _run(view: View, request: Request) -> Answer:
    bench = _movable(view)
    recipe = read_recipe(file_inside(view, request, "recipe", "A recipe file"))
    out = view.out / f"bed_{datetime.now(UTC).strftime('%Y-%m-%dT%H-%M-%S-%f')}Z"
    bench.run(recipe, out)
    return Answer(f"Running {recipe.name} into {out}.")


def section(view: View) -> dict[str, Any]:
    """Return the state of the test bed for the browser page: position and present task."""
    bench: Bench | None = view.features.get(BED)
    if bench is None:
        return {"bed": None}
    return {
        "bed": {
            "movable": bool(view.features.get(MOTION)),
            "limits": bench.limits,
            "position_mm": bench.position_mm,
            "force_n": bench.force_n,
            "doing": bench.doing,
            "progress": bench.progress,
        }
    }


COMMANDS = {"bed_stop": _stop, "bed_home": _home, "bed_move": _move, "bed_jog": _jog, "bed_run": _run}
HARMLESS = frozenset({"bed_stop"})
