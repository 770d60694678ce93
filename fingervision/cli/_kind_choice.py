"""Option type that accepts the name of a kind of model; the names are looked up only when needed."""

from typing import Any

import click


class KindChoice(click.ParamType):  # type: ignore[type-arg]  # generic in new versions of click alone
    """Name of a kind of model, built in or from a plug-in; only names are looked up, and no plug-in is imported.

    Parameters
    ----------
    also : str
        Additional accepted words, which denote several kinds (such as `all`).
    """

    name = "kind"

    def __init__(self, *also: str) -> None:
        self._also = also

    def _names(self) -> tuple[str, ...]:
        from fingervision.models.kind_names import kind_names

        return (*kind_names(), *self._also)

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Return the allowed names for the help text."""
        return f"[{'|'.join(self._names())}]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Refuse an unknown kind, naming the nearest known one."""
        from difflib import get_close_matches

        names = self._names()
        if value not in names:
            near = get_close_matches(str(value), names, n=1)
            hint = f" Did you mean {near[0]}?" if near else ""
            self.fail(f"{value!r} is not one of {', '.join(map(repr, names))}.{hint}", param, ctx)
        return str(value)
