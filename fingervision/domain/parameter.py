"""A parameter of a physical law: its unit, its bounds, and the starting values of a search."""

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
        Unit as printed; empty for a ratio.
    lower, upper : float
        Physical bounds: the range that is searched.
    words : str
        Display name, used in sentences, browser pages and plots; data files use `name`.
    neutral : float or None
        The value at which the effect vanishes; None for a shape parameter (a period, a time constant), which has no
        influence while the effect's amplitude has its neutral value.
    starts : int
        Number of starting values between the bounds that a search tries; 1 for a parameter on which the prediction
        depends nearly linearly.
    logarithmic : bool
        Whether the starting values are spaced logarithmically.
    reciprocal : bool
        Whether the reciprocals of the starting values are evenly spaced (for periods).
    rugged : bool
        Whether the prediction jumps as this parameter changes, so that the search must scan its range.
    typical : float or None
        Physical prior: a value that a carefully operated set-up rarely exceeds. The prior only determines which of
        several indistinguishable explanations is named first.
    run : int or None
        Index of the run whose start state this is, a nuisance parameter that is fitted together with the effect and is
        not reported. None for a parameter of the effect itself.
    place : bool
        Whether this is a place between the bounds, a priori as probable at one place as at another.
    at_ends : bool
        Whether the bounds are the usual values of a start state, each with a probability of its own.
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
    place: bool = False
    at_ends: bool = False

    def starting_values(self) -> NDArray[np.float64]:
        """Values inside the bounds from which a search starts.

        Returns
        -------
        ndarray of float, shape (starts,)
            If `starts` is 1, one value at a hundredth of the range from the neutral value; otherwise values spread over
            the range.
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
        Best estimate of the parameter.
    u : float or None
        Standard uncertainty; None if the data do not determine it (the value lies at a bound, or was set by the user).
    unit : str
        Unit as printed.
    at_least, at_most : float or None
        One-sided 95 % limit if the data limit the parameter on one side only; `value` is then merely the value with
        which the prediction was computed.
    """

    value: float
    u: float | None
    unit: str = ""
    at_least: float | None = None
    at_most: float | None = None
