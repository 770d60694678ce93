"""Drawing of a gripper: material, body, hinges, lever and links."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated

from fingervision.domain.field import Field

PointMm = tuple[float, float]
SHORTEST_MM, LONGEST_MM = 1e-4, 1e5
"""Lengths in a drawing: from 0.1 µm to 100 m; much larger numbers would overflow."""
CHECK_UNIT = "check its unit"


def _length(meaning: str) -> Field:
    return Field(meaning, "mm", low=SHORTEST_MM, high=LONGEST_MM, hint=CHECK_UNIT)


def _place(meaning: str) -> Field:
    return Field(meaning, "mm", low=-LONGEST_MM, high=LONGEST_MM, hint=CHECK_UNIT)


def _angle(meaning: str) -> Field:
    return Field(meaning, "degrees", low=-720.0, high=720.0, hint=CHECK_UNIT)


@dataclass(frozen=True, slots=True)
class SNLine:
    """S-N line of fatigue: stress amplitude over number of cycles, a straight line with both axes logarithmic.

    The line is not extrapolated.
    """

    cycles: Annotated[
        tuple[float, float], Field("numbers of cycles at the start and end of the line, ascending", low=1.0, high=1e12)
    ]
    amplitude_mpa: Annotated[
        tuple[float, float],
        Field("stress amplitudes at the start and end of the line, descending", "MPa", above=0.0, high=1e5),
    ]
    stress_ratio: Annotated[
        float,
        Field(
            "smallest over largest stress in the tests of the line: -1 for fully reversed, 0 for pulsating stress",
            low=-10.0,
            below=1.0,
        ),
    ] = -1.0


@dataclass(frozen=True, slots=True)
class Material:
    """An isotropic elastic material."""

    name: Annotated[str, Field("name of the material")]
    youngs_modulus_mpa: Annotated[float, Field("Young's modulus", "MPa", low=1e-3, high=1e13, hint=CHECK_UNIT)]
    poisson_ratio: Annotated[float, Field("Poisson's ratio", low=0.0, below=0.5)]
    density_kg_m3: Annotated[
        float, Field("density", "kg/m3", low=30.0, high=25000.0, hint="is it in g/cm3? Multiply it by 1000")
    ]
    yield_mpa: Annotated[
        float,
        Field(
            "yield stress, beyond which the result of an elastic model is invalid",
            "MPa",
            low=1e-3,
            high=1e13,
            hint=CHECK_UNIT,
        ),
    ]
    thermal_expansion_per_k: Annotated[
        float | None,
        Field("coefficient of linear thermal expansion, where known", "1/K", low=-1e-2, high=1e-2, hint=CHECK_UNIT),
    ] = None
    sn_line: Annotated[SNLine | None, Field("S-N line of fatigue, where known")] = None

    @property
    def shear_modulus_mpa(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)), in MPa."""
        return self.youngs_modulus_mpa / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def density_t_mm3(self) -> float:
        """Density in t/mm^3, the unit that is consistent with mm, N, MPa and s."""
        return self.density_kg_m3 * 1e-12


@dataclass(frozen=True, slots=True)
class Body:
    """Overall dimensions of the plate, and the height at which the gap is measured."""

    width_mm: Annotated[float, _length("width across both halves")]
    height_mm: Annotated[float, _length("height above the clamp")]
    plate_mm: Annotated[float, _length("thickness of the plate")]
    rest_gap_mm: Annotated[float, _length("distance between the tips at rest")]
    measured_below_tip_mm: Annotated[float, _length("distance of the measuring point below the top of the tip")]


@dataclass(frozen=True, slots=True)
class Hinge:
    """A two-sided circular notch."""

    thickness_mm: Annotated[float, _length("smallest thickness of material between the two notches")]
    radius_mm: Annotated[float, _length("radius of the notches")]
    web_mm: Annotated[
        float, _length("height of the bar into which the notches are cut; at least the thickness of the hinge")
    ]


_LINKS = (
    "link lengths as named by Hricko and Havlík (2015): hinge 2 lies at (-l2, -l1) from hinge 1, the drive point at "
    "(-l4, -l3) from hinge 2"
)
_HINGES, _AXES = "positions of the hinges: centres of the notches", "angle of each hinge's longitudinal axis from x"
_BLOCKS = "rectangles: x from, x to, y from, y to; the pillar is clamped at its lower face"
_BARS = "bars: x and y of one end, and of the other end"


@dataclass(frozen=True, slots=True)
class Lever:
    """Positions of hinges and drive in one half of the gripper; x from the symmetry axis, y up from the clamp (mm)."""

    l1_mm: Annotated[float, _place(_LINKS)]
    l2_mm: Annotated[float, _place(_LINKS)]
    l3_mm: Annotated[float, _place(_LINKS)]
    l4_mm: Annotated[float, _place(_LINKS)]
    hinge1_mm: Annotated[PointMm, _place(_HINGES)]
    hinge1_axis_deg: Annotated[float, _angle(_AXES)]
    hinge2_mm: Annotated[PointMm, _place(_HINGES)]
    hinge2_axis_deg: Annotated[float, _angle(_AXES)]
    drive_mm: Annotated[PointMm, _place("position of the drive point O_A on the symmetry axis")]
    drive_face_y_mm: Annotated[float, _place("height of the face on which the actuator pushes")]
    drive_face_half_width_mm: Annotated[float, _length("half width of that face")]

    @property
    def hinges(self) -> tuple[tuple[PointMm, float], ...]:
        """Places of hinges 1 and 2 (mm), and directions of their axes (degrees)."""
        return (self.hinge1_mm, self.hinge1_axis_deg), (self.hinge2_mm, self.hinge2_axis_deg)


@dataclass(frozen=True, slots=True)
class Links:
    """The bars and polygons whose union, minus the notches, is the right half of the body."""

    pillar_and_root_mm: Annotated[tuple[float, float, float, float], _place(_BLOCKS)]
    shuttle_from_mm: Annotated[PointMm, _place("start of the bar from the drive point through hinge 2")]
    shuttle_to_mm: Annotated[PointMm, _place("end of this bar")]
    shuttle_width_mm: Annotated[float, _length("widths of the bars")]
    drive_block_mm: Annotated[tuple[float, float, float, float], _place(_BLOCKS)]
    cross_bar_mm: Annotated[tuple[float, float, float, float], _place(_BARS)]
    cross_bar_width_mm: Annotated[float, _length("widths of the bars")]
    finger_mm: Annotated[tuple[float, float, float, float], _place(_BARS)]
    finger_width_mm: Annotated[float, _length("widths of the bars")]
    tip_polygon_mm: Annotated[
        tuple[PointMm, ...], _place("corners of the tip; its inner face is the edge at the smallest x")
    ]


@dataclass(frozen=True, slots=True)
class Gripper:
    """One compliant gripper: two mirrored halves of a flat plate.

    Parameters
    ----------
    material, body, hinge, lever, links
        The five sections of `gripper.toml`.
    uncertainties : mapping of str to float
        Stated standard uncertainties of numbers in the drawing, each in the unit of the number, by dotted name
        (`hinge.thickness_mm`).
    """

    material: Material
    body: Body
    hinge: Hinge
    lever: Lever
    links: Links
    # A mapping has no hash; what is computed from a drawing is found again by its numbers.
    uncertainties: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}), hash=False)

    @property
    def tip_corner_mm(self) -> PointMm:
        """Upper end of the tip's inner face: the point that touches the symmetry plane first when the fingers close."""
        inner_mm = min(x for x, _ in self.links.tip_polygon_mm)
        return inner_mm, max(y for x, y in self.links.tip_polygon_mm if x == inner_mm)

    @property
    def tip_heel_mm(self) -> PointMm:
        """Lower end of the tip's inner face."""
        inner_mm = min(x for x, _ in self.links.tip_polygon_mm)
        return inner_mm, min(y for x, y in self.links.tip_polygon_mm if x == inner_mm)

    @property
    def measuring_point_mm(self) -> PointMm:
        """The material point on the inner face whose distance from its mirror image is the gap."""
        x_mm, y_mm = self.tip_corner_mm
        return x_mm, y_mm - self.body.measured_below_tip_mm
