"""The parametric models there are, found by listing this package: a module that states its KIND builds one."""

import importlib
import pkgutil
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper
from fingervision.domain.model import Model
from fingervision.models.answer_figures import ModelFigures
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.physics import Physics


class GripperModel(Model, Protocol):
    """A model built from a drawing."""

    @property
    def name(self) -> str:
        """Its kind."""
        ...

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input that the model is meant for."""
        ...

    @property
    def rest_gap_mm(self) -> float:
        """The gap at input zero."""
        ...

    def body_poses(self, input_mm: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Answer the poses of the bodies at each input: x_mm, y_mm, angle_mrad, shape (n, 3) each."""
        ...

    def figures(self) -> ModelFigures:
        """Compute the model's row of the comparison."""
        ...


class Kind(Protocol):
    """A module that builds a model."""

    KIND: str

    def build(self, gripper: Gripper, physics: Physics, theory: HingeTheory) -> GripperModel:
        """Build it."""
        ...


def kinds() -> tuple[str, ...]:
    """List the kinds of model, sorted."""
    here = Path(__file__).parent
    return tuple(
        sorted(
            module.name
            for module in pkgutil.iter_modules([str(here)])
            if not module.ispkg
            and f'\nKIND = "{module.name}"\n' in (here / f"{module.name}.py").read_text(encoding="utf-8")
        )
    )


def build_model(kind: str, gripper: Gripper, physics: Physics, theory: HingeTheory) -> GripperModel:
    """Build one kind of model of a gripper.

    Parameters
    ----------
    kind : str
        One of `kinds()`.
    gripper : Gripper
        The drawing.
    physics : Physics
        What goes beyond small displacements; `stiffness_matrix` knows small displacements alone.
    theory : HingeTheory
        Of the hinges; `finite_element` has no need of one.

    Raises
    ------
    UsageError
        Where the kind is unknown or does not know the physics asked for.
    """
    if kind not in kinds():
        raise UsageError(f"The kind of model must be one of {', '.join(kinds())}, but is {kind}.")
    module: Kind = importlib.import_module(f"fingervision.models.{kind}")
    return module.build(gripper, physics, theory)
