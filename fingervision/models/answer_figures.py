"""The figures by which models of one gripper are put beside each other."""

from dataclasses import dataclass

from fingervision.domain.gripper import PointMm


@dataclass(frozen=True, slots=True)
class PeakStress:
    """Largest stress on a notch per millimetre of input: von Mises's, or the nominal one of a model made of bars.

    Parameters
    ----------
    mpa_per_mm : float
        Stress per input.
    place_mm : (float, float)
        Where.
    """

    mpa_per_mm: float
    place_mm: PointMm


@dataclass(frozen=True, slots=True)
class ModelFigures:
    """One model's row of the table; what a model does not know is None.

    Parameters
    ----------
    gap_per_input : float
        Millimetres of gap per millimetre of input, at rest.
    input_stiffness_n_mm : float
        Force at the drive per input, both halves.
    peak_stress : PeakStress or None
        On the notches.
    free_modes_hz, locked_modes_hz : tuple of float
        First symmetric in-plane modes with the drive free along its axis, and held.
    contact_input_mm : float or None
        Input at which the fingers first touch.
    swaying_modes_hz, out_of_plane_modes_hz : tuple of float
        First antisymmetric in-plane modes, the drive free to go sideways; first modes out of the plane, drive held.
    """

    gap_per_input: float
    input_stiffness_n_mm: float
    peak_stress: PeakStress | None = None
    free_modes_hz: tuple[float, ...] = ()
    locked_modes_hz: tuple[float, ...] = ()
    contact_input_mm: float | None = None
    swaying_modes_hz: tuple[float, ...] = ()
    out_of_plane_modes_hz: tuple[float, ...] = ()
