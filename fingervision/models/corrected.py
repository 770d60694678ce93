"""A model with effects added to it: the content of `model.toml`."""

from collections.abc import Mapping
from dataclasses import dataclass

from fingervision.domain.model import Model
from fingervision.domain.parameter import Estimate


@dataclass(frozen=True, slots=True)
class CorrectedModel:
    """A base model and the effects added to it, by name; the measuring chain of the diagnosis evaluates them.

    Parameters
    ----------
    name : str
        How the report calls it.
    base : Model
        The gripper without effects.
    base_path : str
        File of the base model.
    input_range_mm : tuple of two floats
        Inputs that the base covers.
    effects : mapping of str to mapping of str to Estimate
        Parameters of each effect.
    kind : str or None
        Kind of gripper model that the base was tabulated from; None for a simulation table.
    """

    name: str
    base: Model
    base_path: str
    input_range_mm: tuple[float, float]
    effects: Mapping[str, Mapping[str, Estimate]]
    kind: str | None = None
