"""A recipe: the motions and measurements that the test bed is to execute."""

from dataclasses import dataclass
from typing import Generic, TypeVar

Step = TypeVar("Step")


@dataclass(frozen=True, slots=True)
class Recipe(Generic[Step]):
    """A recipe with its name, its force limit and its steps.

    Parameters
    ----------
    name : str
        Name of the recipe.
    below_force_n : float
        Force limit of the recipe; the limit of the test bed applies as well.
    steps : tuple
        Steps in order, each in the form that its kind of step defines.
    text : str
        Text of the complete recipe file, stored with the run.
    """

    name: str
    below_force_n: float
    steps: tuple[Step, ...]
    text: str
