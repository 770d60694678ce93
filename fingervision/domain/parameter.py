"""A number of a physical law: its unit, the values it may take, and how a search should step through them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of an effect or a model.

    Parameters
    ----------
    name : str
        Name with its unit, as in every file (`play_mm`).
    unit : str
        As printed; empty for a ratio.
    lower, upper : float
        Physical bounds: the range that is searched.
    words : str
        Display name: what sentences, pages and figures call it. Files keep `name`.
    neutral : float or None
        The value at which the effect changes nothing; None for a shape (a period, a time constant) that by itself
        changes nothing while the effect's amplitude is at its neutral value.
    starts : int
        How many starting values a search tries between the bounds; 1 for a parameter on which the prediction depends
        nearly linearly.
    logarithmic : bool
        Whether the starting values are spaced by a ratio.
    reciprocal : bool
        Whether the reciprocals of the starting values are evenly spaced (for periods).
    rugged : bool
        Whether the prediction jumps as this parameter changes, so that the search must scan its range.
    typical : float or None
        Physical prior: a size that a well-run set-up rarely exceeds. It only decides which of several
        explanations that the data cannot tell apart is named first.
    run : int or None
        The run whose start state this is: a nuisance that is fitted beside the effect and is no part of an answer.
        None for a parameter of the effect itself.
    """

    name: str
    unit: str
    lower: float
    upper: float
    words: str
    neutral: float | None = 0.0
    starts: int = 1
    logarithmic: bool = False
    reciprocal: bool = False
    rugged: bool = False
    typical: float | None = None
    run: int | None = None

    def starting_values(self) -> NDArray[np.float64]:
        """Values inside the bounds from which a search starts.

        Returns
        -------
        ndarray of float, shape (starts,)
            One hundredth of the way from the neutral value where `starts` is 1, otherwise spread over the range.
        """
        if self.starts == 1:
            neutral = self.neutral if self.neutral is not None else 0.5 * (self.lower + self.upper)
            step = 0.01 * ((self.upper - neutral) if self.upper > neutral else (self.lower - neutral))
            return np.array([neutral + step])
        inside = (np.arange(self.starts) + 0.5) / self.starts
        if self.reciprocal:
            return np.asarray(
                1.0 / (1.0 / self.upper + (1.0 / self.lower - 1.0 / self.upper) * inside), dtype=np.float64
            )
        if self.logarithmic:
            lower = max(self.lower, 1e-3 * self.upper)
            return np.asarray(lower * (self.upper / lower) ** inside, dtype=np.float64)
        return np.asarray(self.lower + (self.upper - self.lower) * inside, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Estimate:
    """A parameter's value with its standard uncertainty.

    Parameters
    ----------
    value : float
        Best value.
    u : float or None
        Standard uncertainty; None where the data give none (the value lies at a bound, or was set by hand).
    unit : str
        As printed.
    """

    value: float
    u: float | None
    unit: str = ""
