"""Drawing of a gripper: material, body, hinges, lever and links."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

PointMm = tuple[float, float]


@dataclass(frozen=True, slots=True)
class SNLine:
    """S-N line of fatigue: stress amplitude over number of cycles, a straight line with both axes logarithmic.

    Parameters
    ----------
    cycles : (float, float)
        Numbers of cycles at the start and end of the line, in ascending order; the line is not extrapolated.
    amplitude_mpa : (float, float)
        Stress amplitudes at the start and end of the line, in descending order.
    stress_ratio : float
        Ratio of the smallest to the largest stress in the tests from which the line was obtained; -1 for fully
        reversed, 0 for pulsating stress.
    """

    cycles: tuple[float, float]
    amplitude_mpa: tuple[float, float]
    stress_ratio: float = -1.0


@dataclass(frozen=True, slots=True)
class Material:
    """An isotropic elastic material.

    Parameters
    ----------
    name : str
        Name of the material.
    youngs_modulus_mpa, poisson_ratio : float
        Linear elastic constants.
    density_kg_m3 : float
        Density in kg/m^3.
    yield_mpa : float
        Yield stress, beyond which the result of an elastic model is invalid.
    thermal_expansion_per_k : float or None
        Coefficient of linear thermal expansion; None if not stated.
    sn_line : SNLine or None
        S-N line of fatigue; None if not stated.
    """

    name: str
    youngs_modulus_mpa: float
    poisson_ratio: float
    density_kg_m3: float
    yield_mpa: float
    thermal_expansion_per_k: float | None = None
    sn_line: SNLine | None = None

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
    """Overall dimensions of the plate, and the height at which the gap is measured.

    Parameters
    ----------
    width_mm, height_mm, plate_mm : float
        Width across both halves, height above the clamp, thickness of the plate.
    rest_gap_mm : float
        Distance between the tips at rest.
    measured_below_tip_mm : float
        Distance of the measuring point below the top of the tip.
    """

    width_mm: float
    height_mm: float
    plate_mm: float
    rest_gap_mm: float
    measured_below_tip_mm: float


@dataclass(frozen=True, slots=True)
class Hinge:
    """A two-sided circular notch.

    Parameters
    ----------
    thickness_mm : float
        Smallest thickness of material between the two notches.
    radius_mm : float
        Radius of the notches.
    web_mm : float
        Height of the bar into which the notches are cut; at least the thickness of the hinge.
    """

    thickness_mm: float
    radius_mm: float
    web_mm: float


@dataclass(frozen=True, slots=True)
class Lever:
    """Positions of hinges and drive in one half of the gripper; x from the symmetry axis, y up from the clamp (mm).

    Parameters
    ----------
    l1_mm, l2_mm, l3_mm, l4_mm : float
        Link lengths as named by Hricko and Havlik (2015): hinge 2 lies at (-l2, -l1) from hinge 1, and the drive point
        at (-l4, -l3) from hinge 2.
    hinge1_mm, hinge2_mm : (float, float)
        Positions of the hinges: centres of the notches.
    hinge1_axis_deg, hinge2_axis_deg : float
        Angle of each hinge's longitudinal axis from the x axis.
    drive_mm : (float, float)
        Position of the drive point O_A on the symmetry axis.
    drive_face_y_mm, drive_face_half_width_mm : float
        Height and half width of the face on which the actuator pushes.
    """

    l1_mm: float
    l2_mm: float
    l3_mm: float
    l4_mm: float
    hinge1_mm: PointMm
    hinge1_axis_deg: float
    hinge2_mm: PointMm
    hinge2_axis_deg: float
    drive_mm: PointMm
    drive_face_y_mm: float
    drive_face_half_width_mm: float


@dataclass(frozen=True, slots=True)
class Links:
    """The bars and polygons whose union, minus the notches, is the right half of the body.

    Parameters
    ----------
    pillar_and_root_mm, drive_block_mm : (float, float, float, float)
        Axis-parallel rectangles: x from, x to, y from, y to. The pillar is clamped at its lower face.
    shuttle_from_mm, shuttle_to_mm, shuttle_width_mm : (float, float), (float, float), float
        Start point, end point and width of the bar from the drive point through hinge 2.
    cross_bar_mm, finger_mm : (float, float, float, float)
        Bars, each given by x and y of one end and x and y of the other end.
    cross_bar_width_mm, finger_width_mm : float
        Widths of the cross bar and the finger bar.
    tip_polygon_mm : tuple of (float, float)
        Corners of the tip; the inner face of the tip is the edge at the smallest x.
    """

    pillar_and_root_mm: tuple[float, float, float, float]
    shuttle_from_mm: PointMm
    shuttle_to_mm: PointMm
    shuttle_width_mm: float
    drive_block_mm: tuple[float, float, float, float]
    cross_bar_mm: tuple[float, float, float, float]
    cross_bar_width_mm: float
    finger_mm: tuple[float, float, float, float]
    finger_width_mm: float
    tip_polygon_mm: tuple[PointMm, ...]


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
    uncertainties: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

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
