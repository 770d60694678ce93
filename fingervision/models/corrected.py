"""A model with effects added to it: the content of `model.toml`."""

from collections.abc import Mapping
from dataclasses import dataclass

from calib.short_repr import ShortRepr
from fingervision.domain.model import Model
from fingervision.domain.parameter import Estimate


@dataclass(frozen=True, slots=True, repr=False)
class CorrectedModel(ShortRepr):
    """A base model and the parameters of the effects added to it; the diagnosis evaluates the effects.

    Parameters
    ----------
    name : str
        Name of the model in the report.
    base : Model
        The gripper without effects.
    base_path : str
        Path of the base model's file.
    input_range_mm : tuple of two floats
        Smallest and largest input that the base model covers.
    effects : mapping of str to mapping of str to Estimate
        Estimated parameters of each effect, by the names of effect and parameter.
    kind : str or None
        Kind of gripper model from which the base was tabulated; None for a base made from a simulation table.
    """

    name: str
    base: Model
    base_path: str
    input_range_mm: tuple[float, float]
    effects: Mapping[str, Mapping[str, Estimate]]
    kind: str | None = None
