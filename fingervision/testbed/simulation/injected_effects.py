"""Effects injected into a simulated test bed: from command-line arguments or a sealed file, and into the optics."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import asin, degrees
from pathlib import Path

import numpy as np

from fingervision.domain.effect import Effect, History
from fingervision.domain.errors import DataError, UnknownNameError, UsageError
from fingervision.effects import catalogue
from fingervision.rendering import Camera, RadialLens, Tilt
from fingervision.storage.toml_section import read_section

# Effects that are injected into a simulated test bed, with their parameters.


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


# Size of an effect that is named without a size: this share of the range between its bounds, or this multiple of its
# typical size.
SHARE_OF_BOUNDS, TIMES_TYPICAL = 0.2, 3.0
# Bounds that depend on the data are computed for a run over the inputs of the published sample: 25 samples per second
# at 0.05 mm/s.
USUAL_INPUTS_MM, USUAL_STEP_MM = (-0.45, 1.45), 0.002


def hidden_from(words: tuple[str, ...]) -> Hidden:
    """Read injected effects, each given as `EFFECT[:PARAMETER=VALUE,...]` or by a sealed file.

    A sealed file, which hides the effects from the person who diagnoses the run, has the form of a model.toml:
    `[[effect]]` with `name` and `[effect.parameters]` of plain numbers.

    Raises
    ------
    UsageError
        An effect or parameter is not in the catalogue, or a value is no number.
    DataError, InputFileError
        A file cannot be read or is not valid.
    """
    effects: dict[str, dict[str, float]] = {}
    for word in words:
        more = _sealed(Path(word)) if word.lower().endswith(".toml") else [_spoken(word)]
        for name, values in more:
            if name in effects:
                raise UsageError(f"--hide may name each effect only once, but {name} is named twice: leave one out.")
            effects[name] = usual_values(catalogue()[name]) | values
    return Hidden(effects)


def usual_values(effect: Effect) -> dict[str, float]:
    """Parameter values for an injected effect without stated values: clearly visible, and within the bounds."""
    inputs = np.arange(*USUAL_INPUTS_MM, USUAL_STEP_MM)
    history = History(
        input_mm=inputs,
        time_s=np.arange(inputs.size) / 25.0,
        runs=(slice(0, inputs.size),),
        rest_gap_mm=4.0,
        opening_mm=11.0,
        closing_mm=3.5,
        force=True,
    )
    searched = effect.search(history)
    values = {}
    for p in effect.parameters if isinstance(searched, str) else searched:
        if p.run is not None:  # parameters of single runs keep their defaults
            continue
        if p.typical is not None:
            values[p.name] = min(TIMES_TYPICAL * p.typical, p.upper)
        elif p.neutral is not None:
            values[p.name] = p.neutral + SHARE_OF_BOUNDS * ((p.upper if p.upper > p.neutral else p.lower) - p.neutral)
        elif p.logarithmic or p.reciprocal:
            values[p.name] = float(np.sqrt(max(p.lower, 1e-3 * p.upper) * p.upper))
        else:
            values[p.name] = p.lower + SHARE_OF_BOUNDS * (p.upper - p.lower)
    return values


def _spoken(word: str) -> tuple[str, dict[str, float]]:
    name, _, rest = word.partition(":")
    if name not in catalogue():
        raise UnknownNameError("hide", name, catalogue(), "an effect", "`fingervision effects` lists them")
    values: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        key, equals, number = part.partition("=")
        if not equals:
            raise UsageError(f"--hide must be EFFECT or EFFECT:PARAMETER=VALUE,..., but is {word}.")
        try:
            values[key.strip()] = float(number)
        except ValueError:
            raise UsageError(f"{key} of {name} must be a number, but is {number}.") from None
    _inside(name, values)
    return name, values


def _sealed(path: Path) -> list[tuple[str, dict[str, float]]]:
    top = read_section(path, "sealed file")
    top.only(("schema", "effect"))
    read = []
    for section in top.tables("effect"):
        section.only(("name", "parameters"))
        name = section.word("name", of=catalogue())
        parameters = section.table("parameters")
        values = {key: parameters.number(key) for key in parameters.values}
        _inside(name, values)
        read.append((name, values))
    if not read:
        raise DataError(f"{path} must have at least one [[effect]], but has none.")
    return read


def _inside(name: str, values: dict[str, float]) -> None:
    known = {p.name: p for p in catalogue()[name].parameters}
    for key, value in values.items():
        if key not in known:
            raise UsageError(f"A parameter of {name} must be one of {', '.join(known)}, but is {key}.")
        p = known[key]
        if not p.lower <= value <= p.upper:
            raise UsageError(f"{key} of {name} must be between {p.lower:g} and {p.upper:g}, but is {value:g}.")


# Sine of the tilt for a keystone effect as in the catalogue: the camera is then so near that the required tilt hardly
# shortens the plane.
TILT_SINE = 0.01


@dataclass(frozen=True, slots=True)
class Optics:
    """Optical settings with which a frame is rendered.

    Parameters
    ----------
    camera : Camera
        Tilt, lens, blur, noise.
    px_per_mm : float
        Scale at the centre of the picture.
    half_diagonal_mm : float
        Half diagonal of the frame.
    late_s : float
        Delay: a frame shows the scene this long before its time stamp.
    """

    camera: Camera
    px_per_mm: float
    half_diagonal_mm: float
    late_s: float = 0.0


def _lens(optics: Optics, k_per_mm2: float) -> Optics:
    """Convert the distortion x (1 + k x^2) in mm to the renderer's coordinate q = r / (half the diagonal)."""
    lens = RadialLens(k1=k_per_mm2 * optics.half_diagonal_mm**2)
    return replace(optics, camera=replace(optics.camera, lens=lens))


def _tilt(optics: Optics, k_per_mm: float) -> Optics:
    """Convert the keystone distortion x / (1 + k x) in mm to a tilted plane: k = sin(tilt) / distance."""
    sine = TILT_SINE if k_per_mm > 0.0 else -TILT_SINE
    tilt = Tilt(about_y_deg=degrees(asin(sine)), distance_px=sine / k_per_mm * optics.px_per_mm)
    return replace(optics, camera=replace(optics.camera, tilt=tilt))


def in_the_picture(name: str) -> bool:
    """Whether a camera effect is applied to the rendered picture itself.

    All other camera effects are applied by moving the scene in front of the camera, which is equivalent for drifts and
    scale errors. An edge bias in the picture would change the gap of round tips by less than the gap of straight edges,
    because the tips move down as well. The effect `edge_bias` of the catalogue does not depend on the tips, and is
    therefore also applied by moving the fingers.
    """
    return catalogue()[name].in_picture is not None


def hidden_in(optics: Optics, hidden: Hidden) -> Optics:
    """Add the injected effects of the camera to the optical settings."""
    for name, values in hidden.of_stage("camera").items():
        form_of = catalogue()[name].in_picture
        if form_of is None:
            continue
        form = form_of(values)
        optics = replace(optics, late_s=optics.late_s + form.late_s)
        if form.radial_per_mm2 != 0.0:
            optics = _lens(optics, form.radial_per_mm2)
        if form.keystone_per_mm != 0.0:
            optics = _tilt(optics, form.keystone_per_mm)
    return optics
