"""The type of options that are decimal numbers, with a decimal point or comma."""

from typing import Any

import click

from fingervision.domain.errors import ArgumentError, UsageError
from fingervision.domain.numbers import stated_number


class Number(click.types.FloatParamType):
    """A finite decimal number; a comma is understood where only one reading is possible.

    Parameters
    ----------
    above : float or None
        The number must be greater than this.
    """

    def __init__(self, above: float | None = None) -> None:
        self._above = above

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read the number; errors begin with the option as it was typed."""
        option = param.opts[0] if isinstance(param, click.Option) else str(param and param.human_readable_name)
        if isinstance(value, str):
            try:
                value = stated_number(value, option)
            except ArgumentError as error:
                raise UsageError(str(error)) from None
        if self._above is not None and not value > self._above:
            raise UsageError(f"{option} must be greater than {self._above:g}, but is {value:g}.")
        return float(value)


NUMBER = Number()
