"""What a model of a gripper includes, and the characteristic numbers by which models are compared."""

from dataclasses import dataclass

from fingervision.domain.gripper import PointMm


@dataclass(frozen=True, slots=True)
class PeakStress:
    """Largest stress in a notch per millimetre of input: von Mises stress, or the nominal stress of a beam model.

    Parameters
    ----------
    mpa_per_mm : float
        Stress per millimetre of input.
    place_mm : (float, float)
        Position of the largest stress (x, y).
    """

    mpa_per_mm: float
    place_mm: PointMm


@dataclass(frozen=True, slots=True)
class LoadedState:
    """State of one model at one input, with all the physics (large rotation, contact) that the model includes.

    Parameters
    ----------
    input_mm, gap_mm, force_n : float
        Input, gap, and force at the drive of both halves together.
    grip_n : float
        Contact force of the symmetry plane on each finger; 0 where the fingers do not touch.
    stress_mpa : float
        Largest stress on a notch: the von Mises stress, or the nominal stress for a model made of bars.
    place_mm : (float, float)
        Position of the largest stress at zero input (x, y).
    """

    input_mm: float
    gap_mm: float
    force_n: float
    grip_n: float
    stress_mpa: float
    place_mm: PointMm


@dataclass(frozen=True, slots=True)
class ModelFigures:
    """Characteristic numbers of one model for the comparison table; None for a number that the model cannot give.

    Parameters
    ----------
    gap_per_input : float
        Millimetres of gap per millimetre of input, at zero input.
    input_stiffness_n_mm : float
        Force at the drive of both halves per millimetre of input.
    peak_stress : PeakStress or None
        Largest stress on the notches.
    free_modes_hz, locked_modes_hz : tuple of float
        First natural frequencies of the symmetric in-plane modes, with the drive free along its axis, and with the
        drive held.
    contact_input_mm : float or None
        Input at which the fingers first touch.
    swaying_modes_hz, out_of_plane_modes_hz : tuple of float
        First natural frequencies of the antisymmetric in-plane modes, with the drive free to move sideways; first
        natural frequencies out of the plane, with the drive held.
    sag_out_of_plane_mm : float or None
        Sag of the measuring point of a horizontal plate by its own weight, drive held.
    slope_error, force_error, mode_error, out_of_plane_error, sag_error, grip_error : float
        Relative model errors, as known for the kind: of the gap per input, of the force, of the frequencies in the
        plane and out of it, of the sag out of it, of the force on a part or on the other finger. Each is a bound that
        held for the grippers that the kind was checked on.
    """

    gap_per_input: float
    input_stiffness_n_mm: float
    peak_stress: PeakStress | None = None
    free_modes_hz: tuple[float, ...] = ()
    locked_modes_hz: tuple[float, ...] = ()
    contact_input_mm: float | None = None
    swaying_modes_hz: tuple[float, ...] = ()
    out_of_plane_modes_hz: tuple[float, ...] = ()
    sag_out_of_plane_mm: float | None = None
    slope_error: float = 0.0
    force_error: float = 0.0
    mode_error: float = 0.0
    out_of_plane_error: float = 0.0
    sag_error: float = 0.0
    grip_error: float = 0.0


# Options of a mechanical model for physics beyond small displacements.


@dataclass(frozen=True, slots=True)
class Physics:
    """Options of a mechanical model; with all options off it is the linear model of Hricko & Havlik (2015).

    Parameters
    ----------
    large_rotation : bool
        Compute the equilibrium in the deformed shape. For the reference gripper this changes the gap by +0.3 % and the
        force by +6 % at a gap of 18 mm.
    contact : bool
        Prevent the fingers from passing through the symmetry plane.
    """

    large_rotation: bool = False
    contact: bool = False


LINEAR = Physics()
