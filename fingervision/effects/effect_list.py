"""The catalogue as `fingervision.effects`: iterate over it, take its length, or look up an effect by its name."""

from collections.abc import Iterator
from html import escape
from types import ModuleType

from fingervision.domain.effect import Effect
from fingervision.domain.errors import UnknownNameError


class EffectList(ModuleType):
    """Type of the package of effects, which is also a list of the effects in the order of the measuring chain.

    Examples
    --------
    >>> import fingervision as fv
    >>> fv.effects["backlash"].words
    'after a reversal, the mechanism moves only once the play is taken up'
    >>> [effect.name for effect in fv.effects if effect.stage == "drive"][:2]
    ['drive_lag', 'input_offset']
    >>> "backlash" in fv.effects, fv.effects.backlash is fv.effects["backlash"]
    (True, True)
    """

    def __setattr__(self, name: str, value: object) -> None:
        # Python adds the module of an effect as an attribute when it is imported; the effect itself stays.
        super().__setattr__(name, getattr(value, "EFFECT", value) if isinstance(value, ModuleType) else value)

    def __getattr__(self, name: str) -> Effect:
        if name.startswith("__") or name not in (known := self._known()):
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}", name=name, obj=self)
        return known[name]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._known()})

    def _known(self) -> dict[str, Effect]:
        known: dict[str, Effect] = vars(self)["catalogue"]()
        return known

    def __iter__(self) -> Iterator[Effect]:
        return iter(self._known().values())

    def __len__(self) -> int:
        return len(self._known())

    def __bool__(self) -> bool:
        return True

    def __contains__(self, name: object) -> bool:
        return name in self._known()

    def __getitem__(self, name: str) -> Effect:
        """Look up an effect by its name.

        Raises
        ------
        UnknownNameError
            The catalogue has no effect of that name; the message suggests the nearest name. The error is a KeyError
            too.
        """
        known = self._known()
        if name not in known:
            raise UnknownNameError(
                "name", str(name), known, "an effect of the catalogue", "fingervision.effects lists them"
            )
        return known[name]

    def __repr__(self) -> str:
        width = max(len(name) for name in self._known())
        return "\n".join(f"{name:{width}} {effect.stage!s:10} {effect.words}" for name, effect in self._known().items())

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{effect.stage!s}</td><td>{escape(effect.words)}</td></tr>"
            for name, effect in self._known().items()
        )
        return f"<table><tr><th>effect</th><th>stage</th><th>what happens</th></tr>{rows}</table>"


__all__ = ["EffectList"]
