"""Compare drawings to which nothing was fitted with wedge elements of CalculiX: motions, force, stress and modes.

`--both-ways` takes eight other mechanisms, of which cuts leave three, each with its driven face free to turn and held,
and prints every difference beside the error that the product states for it.
"""

import shutil
import sys
import time
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.gripper_mechanism import half_mechanism, whole_mechanism
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import mechanism_figures
from fingervision.models.out_of_plane import out_of_plane
from fingervision.models.triangulate import triangulate
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import read_drawing
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.models_held_out import ABS, ALUMINIUM, SILICON, STEEL, TITANIUM, drawn
from tests.benchmarks.solid_reference import SolidAnswer, solid_answer

ROOT = Path(__file__).parents[2]
# Columns: material, scale of the published drawing (with links of 17.7 to 19.4 mm), then hinge thickness, radius and
# plate thickness in mm, and the increase of l2 and l3 before scaling.
GRIPPERS = (
    (ALUMINIUM, 0.7, 0.05, 4.0, 1.0, 0.0, 0.0),
    (STEEL, 0.55, 0.05, 1.0, 1.0, 2.0, 1.0),
    (ABS, 2.5, 2.0, 8.0, 20.0, 0.0, 0.0),
    (TITANIUM, 1.0, 0.4, 2.0, 4.0, 5.0, 6.0),
    (SILICON, 1.0, 0.15, 3.0, 1.5, -4.0, 0.0),
    (STEEL, 3.0, 2.0, 6.0, 2.0, 0.0, 1.0),
    (ABS, 1.0, 0.8, 3.5, 16.0, 3.0, -2.0),
    (TITANIUM, 2.0, 0.8, 7.0, 2.5, -2.0, 0.0),
)
ACROSS = 3.0
"""The same number of triangles where the stress is compared too."""
FINER = (2.0, 0.05)
"""Two refinements of the plane mesh of the solid elements: number of triangles across, and edge length over size."""


def scaled(thing: Any, factor: float) -> Any:
    """Multiply every length in the records of a drawing by a factor."""
    if not is_dataclass(thing):
        return thing
    changed: dict[str, Any] = {}
    for field in fields(thing):
        value = getattr(thing, field.name)
        changed[field.name] = _times(value, factor) if field.name.endswith("_mm") else scaled(value, factor)
    return replace(thing, **changed)  # type: ignore[type-var]


def _times(value: Any, factor: float) -> Any:
    return tuple(_times(part, factor) for part in value) if isinstance(value, tuple) else factor * value


def gripper_of(sample: Gripper, row: tuple[Any, ...]) -> Gripper:
    """Draw one of `GRIPPERS`."""
    material, scale, thickness_mm, radius_mm, plate_mm, l2_by, l3_by = row
    own = (material, thickness_mm / scale, radius_mm / scale, plate_mm / scale, l2_by, l3_by)
    gripper: Gripper = scaled(slim(drawn(sample, own)), scale)
    return gripper


def slim(gripper: Gripper) -> Gripper:
    """Make shuttle and pillar as narrow as the cuts of the hinges are wide; in wider bars the cuts would be closed
    holes.
    """
    cut_mm = 2.0 * gripper.hinge.radius_mm + gripper.hinge.thickness_mm
    if cut_mm >= gripper.links.shuttle_width_mm:
        return gripper
    at_mm, (_, _, low, high) = gripper.lever.hinge1_mm[0], gripper.links.pillar_and_root_mm
    pillar = (at_mm - 0.5 * cut_mm, at_mm + 0.5 * cut_mm, low, high)
    links = replace(gripper.links, shuttle_width_mm=cut_mm, pillar_and_root_mm=pillar)
    return replace(gripper, hinge=replace(gripper.hinge, web_mm=cut_mm), links=links)


def cases() -> list[tuple[str, Mechanism, Gripper | None]]:
    """Yield every drawing: half grippers, a whole asymmetric gripper, and mechanisms described by their bodies."""
    sample = read_gripper(ROOT / "sample_frames" / "paper" / "gripper.toml")
    found: list[tuple[str, Mechanism, Gripper | None]] = []
    for row in GRIPPERS:
        gripper = gripper_of(sample, row)
        name = f"{row[0].name} x{row[1]:g}, t {row[2]:g}, R {row[3]:g}, plate {row[4]:g}"
        half = half_mechanism(gripper)
        alone = replace(half, mirrored=False, probes={"tip": gripper.measuring_point_mm}, pairs={})
        found.append((name, alone))
    other = replace(sample, hinge=replace(sample.hinge, thickness_mm=0.7))
    found.append(("asymmetric gripper, t 1 and 0.7", whole_mechanism(sample, other, "asymmetric")))
    for path in sorted((Path(__file__).parent / "mechanisms").glob("*.toml")):
        mechanism = read_drawing(path).mechanism()
        found.append((mechanism.name, mechanism))
    return found


def _percent(ours: float, solid: float) -> str:
    return f"{100.0 * (ours / solid - 1.0):+7.3f}"


def both_ways(asked: Namespace) -> None:
    """Print, for each mechanism and way of driving, the differences in % and the stated errors."""
    print("drawing, face: model | motion | force | stress | modes with free and held drive; each difference (stated)")
    missed, unsaid, count = 0, 0, 0
    for place, path in enumerate(sorted((Path(__file__).parent / "mechanisms" / "both_ways").glob("*.toml"))):
        if asked.only is not None and place not in asked.only:
            continue
        drawing = read_drawing(path).mechanism()
        mesh = triangulate(drawing.region, ACROSS * asked.finer, FINER[1] * drawing.region.size_mm / asked.finer)
        for turns in ("free", "held"):
            mechanism = replace(drawing, drives=tuple(replace(drive, turns=turns) for drive in drawing.drives))
            began = time.perf_counter()
            solid = solid_answer(mechanism, mesh, layers=asked.layers, modes=("free", "held"), count=3)
            size, seconds = mesh.triangles.shape[1], time.perf_counter() - began
            print(f"{place} {mechanism.name}, {turns}: {solid.force_n:.5g} N, {solid.stress_mpa:.5g} MPa "
                  f"({size} wedges a layer, {seconds:.0f} s)", flush=True)  # fmt: skip
            for kind in (MechanismPlate, MechanismFrame):
                cells = []
                for name, bar, difference, stated in differences(kind(mechanism), solid):
                    short = abs(difference) > bar + (1.5 if (name, kind) == ("force", MechanismFrame) else 0.0)
                    over = abs(difference) > stated
                    missed, unsaid, count = missed + short, unsaid + over, count + 1
                    cells.append(f"{difference:+6.2f} ({stated:.2f}){'*' if short else ''}{'!' if over else ''}")
                print(f"    {kind.kind:14s} | {' | '.join(cells)}", flush=True)
    print(f"of {count} figures {missed} are beyond the bar (*), and {unsaid} beyond the stated error (!)")


def differences(model: MechanismPlate | MechanismFrame, solid: SolidAnswer) -> list[tuple[str, float, float, float]]:
    """Name, bar, difference from the solid and stated error of every figure (%); a refused stress has none."""
    unit, figures = model.state(1.0), mechanism_figures(model)
    moved, theirs = (np.array(list(probes.values())) for probes in (unit.probes_mm, solid.probes_mm))
    motion = 100.0 * float(np.hypot(*(moved - theirs).T).max() / np.hypot(*theirs.T).max())
    found = [
        ("motion", 0.5, motion, figures.get("model_error_motion_percent", 0.0)),
        ("force", 1.5, 100.0 * (unit.force_n / solid.force_n - 1.0), figures["model_error_force_percent"]),
    ]
    if "peak_stress_mpa_per_mm" in figures:
        stress = 100.0 * (unit.stress_mpa / solid.stress_mpa - 1.0)
        found.append(("stress", 2.0, stress, figures["model_error_stress_percent"]))
    for held in (False, True):
        ours = model.modes_hz(drive_held=held)
        apart = (100.0 * (a / b - 1.0) for a, b in zip(ours, solid.modes_hz["held" if held else "free"], strict=True))
        found += [("mode", 2.0, each, figures["model_error_modes_percent"]) for each in apart]
    return found


@benchmark(
    only={"type": int, "nargs": "*", "help": "places of drawings in the list; all without"},
    layers={"type": int, "default": 2, "help": "wedges through half the plate"},
    both_ways=False,
    finer={"type": float, "default": 1.0, "help": "with --both-ways: factor by which the elements are finer"},
)
def main(asked: Namespace) -> None:
    """Print one line per drawing: errors (%) of the plane models compared with the three-dimensional model."""
    if shutil.which("ccx") is None:
        sys.exit("CalculiX (ccx, Debian package calculix-ccx) must be installed, but is not.")
    if asked.both_ways:
        both_ways(asked)
        return
    print("drawing | largest motion of a probe: finite_element, lumped | force: same | mode in the plane, drive held: "
          "same | out of the plane: finite_element | s of CalculiX")  # fmt: skip
    for place, (title, mechanism) in enumerate(cases()):
        if asked.only is not None and place not in asked.only:
            continue
        region = mechanism.region
        began = time.perf_counter()
        mesh = triangulate(region, FINER[0], FINER[1] * region.size_mm)
        solid = solid_answer(mechanism, mesh, layers=asked.layers)
        seconds = time.perf_counter() - began
        flat, lifted = solid.modes_hz["held"][0], solid.modes_hz["out"][0]
        cells: list[list[str]] = [[], [], []]
        far, way = max(
            ((name, axis) for name in solid.probes_mm for axis in (0, 1)),
            key=lambda one, moved=solid.probes_mm: abs(moved[one[0]][one[1]]),
        )
        for kind in (MechanismPlate, MechanismFrame):
            model = kind(mechanism)
            unit = model.state(1.0)
            cells[0].append(_percent(unit.probes_mm[far][way], solid.probes_mm[far][way]))
            cells[1].append(_percent(unit.force_n, solid.force_n))
            cells[2].append(_percent(model.modes_hz(drive_held=True, count=1)[0], flat))
        across = [_percent(out_of_plane(mechanism).modes_hz[0], lifted)]
        print(f"{place:2d} {title:44s} | {' | '.join(' '.join(part) for part in (*cells, across))} | {seconds:.0f} s",
              flush=True)  # fmt: skip
