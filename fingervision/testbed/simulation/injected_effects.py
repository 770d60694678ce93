"""Effects that are injected into a simulated test bed, with their parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from fingervision.effects import catalogue


@dataclass(frozen=True, slots=True)
class Hidden:
    """Effects that act in the simulated parts; measurement and diagnosis do not receive them.

    Parameters
    ----------
    effects : mapping of str to mapping of str to float
        Parameters of each effect, by their names in the catalogue.
    """

    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def of_stage(self, stage: str) -> dict[str, Mapping[str, float]]:
        """Injected effects of one section of the measuring chain, in the order in which they act."""
        return {
            name: self.effects[name]
            for name, effect in catalogue().items()
            if name in self.effects and effect.stage == stage
        }


NOTHING = Hidden()
