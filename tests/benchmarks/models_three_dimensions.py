"""Compare slope, force and modes of drawings to which nothing was fitted with wedge elements of CalculiX."""

import shutil
import sys
import time
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.gripper_mechanism import half_mechanism, whole_mechanism
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.out_of_plane import out_of_plane
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.triangulate import triangulate
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import read_drawing
from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.models_held_out import ABS, ALUMINIUM, SILICON, STEEL, TITANIUM, drawn
from tests.benchmarks.solid_reference import solid_answer

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


def _percent(ours: float, solid: float | None) -> str:
    return f"{100.0 * (ours / solid - 1.0):+7.3f}" if solid else "      -"


@benchmark(
    only={"type": int, "nargs": "*", "help": "places of drawings in the list; all without"},
    layers={"type": int, "default": 4, "help": "wedges through the plate"},
)
def main(asked: Namespace) -> None:
    """Print one line per drawing: errors (%) of the plane models compared with the three-dimensional model."""
    if shutil.which("ccx") is None:
        sys.exit("CalculiX (ccx, Debian package calculix-ccx) must be installed, but is not.")
    print("drawing | largest motion of a probe: finite_element, lumped | force: same | mode in the plane, drive held: "
          "same | out of the plane: finite_element | s of CalculiX")  # fmt: skip
    for place, (title, mechanism) in enumerate(cases()):
        if asked.only is not None and place not in asked.only:
            continue
        region = mechanism.region
        marked = PlanarRegion(region.steps, (*region.marks_mm, *mechanism.probes.values()))
        began = time.perf_counter()
        solid = solid_answer(mechanism, triangulate(marked, FINER[0], FINER[1] * region.size_mm), layers=asked.layers,
                             modes=3)  # fmt: skip
        seconds = time.perf_counter() - began
        flat = next((value for value, out in solid.modes if not out), None)
        lifted = next((value for value, out in solid.modes if out), None)
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
