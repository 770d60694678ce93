"""A recipe: the motions and measurements that the test bed shall execute."""

from dataclasses import dataclass
from typing import Generic, TypeVar

Step = TypeVar("Step")


@dataclass(frozen=True, slots=True)
class Recipe(Generic[Step]):
    """The steps of a run.

    Parameters
    ----------
    name : str
        What it is called.
    below_force_n : float
        The force that it must not go beyond; the bed's own limit holds as well.
    steps : tuple
        In order, each as its kind reads it.
    text : str
        The whole file, kept with the run.
    """

    name: str
    below_force_n: float
    steps: tuple[Step, ...]
    text: str
