"""Objects that are pickled as the arguments that they were made from, because what they compute cannot be pickled."""

from collections.abc import Mapping
from typing import Any, Self


class MadeAgain:
    """An object that a pickle makes again from its arguments: factorised matrices stay in their process."""

    _arguments: tuple[tuple[Any, ...], Mapping[str, Any]]

    def __new__(cls, *arguments: Any, **named: Any) -> Self:
        """Note the arguments."""
        made = super().__new__(cls)
        made._arguments = arguments, named
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how a pickle makes the object."""
        return _again, (type(self), *self._arguments)


def _again(kind: type[Any], arguments: tuple[Any, ...], named: Mapping[str, Any]) -> Any:
    return kind(*arguments, **named)
