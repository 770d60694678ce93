"""Registry of the parametric models: modules of this package that define KIND, and models from other distributions."""

import importlib
from collections.abc import Callable, Iterable, Mapping
from itertools import combinations
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError, UsageError, error_words
from fingervision.domain.gripper import Gripper
from fingervision.domain.model import Model
from fingervision.models.answer_figures import LINEAR, ModelFigures, Physics
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kind_names import GROUP, built_in_kinds
from fingervision.plugins.faults import MisfitError, PluginShapeError
from fingervision.plugins.origin import Origin
from fingervision.plugins.registry import Registry

DEFAULT = "lumped"


class GripperModel(Model, Protocol):
    """A model built from a drawing."""

    @property
    def name(self) -> str:
        """Name of the model's kind."""
        ...

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input for which the model is valid (mm)."""
        ...

    @property
    def rest_gap_mm(self) -> float:
        """The gap at zero input (mm)."""
        ...

    def body_poses(self, input_mm: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Poses of the bodies at each input: x_mm, y_mm, angle_mrad, shape (n, 3) each.

        A model from outside the package may lack the method `body_poses`.
        """
        ...

    def figures(self) -> ModelFigures:
        """Characteristic numbers of the model for the comparison table."""
        ...


class Kind(Protocol):
    """Protocol of a kind of model: a module, or another object, that builds a model of a gripper.

    Optional attributes are `SMALL_DISPLACEMENTS_ALONE` (True for a model without large rotation and contact) and
    `TRUST`, a number (finite elements of the outline 3, bars in the plane 2, bars at small displacements 1; default 0).
    If two kinds of model differ by more than their own errors, the kind with the larger `TRUST` is trusted, for the
    reason given in `WHY_TRUSTED`.
    """

    KIND: str

    def build(self, gripper: Gripper, physics: Physics, theory: HingeTheory) -> GripperModel:
        """Build the model of a gripper."""
        ...


def _held(held: object) -> dict[str, Kind]:
    name = getattr(held, "KIND", None)
    if not isinstance(name, str) or not callable(getattr(held, "build", None)):
        raise MisfitError(
            "must state KIND, its name, and have build(gripper, physics, theory), but "
            f"{'has no build' if isinstance(name, str) else 'states no KIND'}"
        )
    return {name: cast("Kind", held)}


REGISTRY: Registry[Kind] = Registry(
    GROUP,
    "model",
    built_in_kinds,
    lambda name: cast("Kind", importlib.import_module(f"fingervision.models.{name}")),
    _held,
)


def kinds() -> tuple[str, ...]:
    """List the kinds of model: the built-in ones sorted by name, then the installed ones."""
    return REGISTRY.names()


def small_displacements_alone(kind: str) -> bool:
    """Whether a kind models neither large rotation nor contact."""
    return bool(getattr(REGISTRY.get(kind).value, "SMALL_DISPLACEMENTS_ALONE", False))


def by_trust(names: Iterable[str]) -> list[str]:
    """Sort kinds of model, the most trusted first; names of no kind come last in their given order."""
    return sorted(names, key=lambda name: -trust(name))


def trust(kind: str) -> int:
    """Rank by which a kind of model is trusted: a kind with a larger rank represents more of the drawing's outline."""
    return int(getattr(REGISTRY.get(kind).value, "TRUST", 0)) if kind in kinds() else 0


def why_trusted(kind: str) -> str:
    """Reason why this kind of model is more accurate than simpler kinds; empty if the module gives none."""
    return str(getattr(REGISTRY.get(kind).value, "WHY_TRUSTED", "")) if kind in kinds() else ""


def build_model(kind: str, gripper: Gripper, physics: Physics, theory: HingeTheory) -> GripperModel:
    """Build one kind of model of a gripper.

    Parameters
    ----------
    kind : str
        One of `kinds()`.
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included; some kinds support small displacements only.
    theory : HingeTheory
        Theory of the hinges' compliance; not used by `finite_element`.

    Raises
    ------
    UsageError
        If the kind is unknown or does not support the requested physics.
    PluginShapeError
        If a model from outside the package fails or returns an invalid result.
    """
    try:
        entry = REGISTRY.get(kind)
    except KeyError:
        raise UsageError(f"The kind of model must be one of {', '.join(kinds())}, but is {kind}.") from None
    if entry.origin.built_in:
        return entry.value.build(gripper, physics, theory)
    if physics != LINEAR and small_displacements_alone(kind):
        raise UsageError(f"{kind} handles small displacements only: leave out --large-rotation and --contact.")
    return _tried(kind, entry.origin, entry.value, gripper, physics, theory)


def _tried(
    kind: str, origin: Origin, builder: Kind, gripper: Gripper, physics: Physics, theory: HingeTheory
) -> GripperModel:
    """Build a model from outside the package, and check its response at one input."""
    who = f"The model {kind} of {origin}"
    try:
        model = builder.build(gripper, physics, theory)
        low, high = model.input_range_mm
        asked = np.array([low, 0.0, high])
        answer = model.respond(asked)
        shapes = {np.shape(answer.left_mm), np.shape(answer.right_mm)}
        rest_mm = float(model.rest_gap_mm)
        figures = model.figures()
        gap_mm = np.asarray(answer.gap_mm)
    except FingervisionError:
        raise
    except Exception as error:
        raise PluginShapeError(
            f"{who} must work for every drawing, but raised {error_words(error)}: {origin.remedy}."
        ) from error
    if shapes != {asked.shape} or not np.all(np.isfinite(gap_mm)):
        words = f"{gap_mm.tolist()}" if shapes == {asked.shape} else f"shape {sorted(shapes)}"
        raise PluginShapeError(
            f"{who} must give three finite gaps for three inputs, but gave {words}: {origin.remedy}."
        )
    if not np.isclose(gap_mm[1], rest_mm, rtol=0.0, atol=1e-9 * max(1.0, abs(rest_mm))):
        raise PluginShapeError(
            f"{who} must have its rest gap of {rest_mm:g} mm at input 0, but has {gap_mm[1]:g} mm: {origin.remedy}."
        )
    if not isinstance(figures, ModelFigures):
        given = type(figures).__name__
        raise PluginShapeError(
            f"{who} must return a ModelFigures object from `figures`, but returned a {given}: {origin.remedy}."
        )
    if figures.peak_stress is not None and not hasattr(model, "loaded"):
        raise PluginShapeError(
            f"{who} must have a method loaded(inputs_mm) if it states a stress, but has none: {origin.remedy}."
        )
    return model


# Find quantities on which different kinds of model of one drawing disagree, and name the kind to trust.
#
# A disagreement is a difference larger than the stated model errors of the two kinds together plus 10 %.

_APART = 0.10
"""Relative difference, beyond the sum of the two kinds' stated errors, above which two kinds are reported to disagree.
A larger difference means that the two kinds represent the body's geometry differently."""
_Figure = Callable[[ModelFigures], float | None]
_QUANTITIES: tuple[tuple[str, str, _Figure, Callable[[ModelFigures], float]], ...] = (
    ("gap per input", "", lambda f: f.gap_per_input, lambda f: f.slope_error),
    ("force per input", " N/mm", lambda f: f.input_stiffness_n_mm, lambda f: f.force_error),
    ("first mode, drive free", " Hz", lambda f: next(iter(f.free_modes_hz), None), lambda f: f.mode_error),
    ("first mode, drive held", " Hz", lambda f: next(iter(f.locked_modes_hz), None), lambda f: f.mode_error),
)


def disagreements(figures: Mapping[str, ModelFigures]) -> list[str]:
    """Compare the gap per input, the force per input and the first modes between every pair of kinds of model.

    Parameters
    ----------
    figures : mapping of str to ModelFigures
        Results of each model, by the name of its kind.

    Returns
    -------
    list of str
        One sentence for each quantity on which kinds disagree; if several pairs of kinds disagree, it is about the pair
        with the largest difference.
    """
    kinds = by_trust(figures)
    sentences = []
    for name, unit, value, error in _QUANTITIES:
        worst = None
        for better, other in combinations(kinds, 2):
            a, b = value(figures[better]), value(figures[other])
            if a is None or b is None:
                continue
            errors = error(figures[better]) + error(figures[other])
            apart = abs(b - a) / max(abs(a), 1e-300)
            if apart > _APART + errors and (worst is None or apart > worst[0]):
                worst = (apart, better, other, a, b, errors)
        if worst is not None:
            apart, better, other, a, b, errors = worst
            sentences.append(
                f"{better} and {other} must agree on the {name} within the sum of their model errors, "
                f"{100.0 * errors:.2g} %, but have {a:.4g} and {b:.4g}{unit}, {100.0 * apart:.3g} % apart; trust "
                f"{better}: {why_trusted(better) or 'it is listed first'}."
            )
    return sentences
