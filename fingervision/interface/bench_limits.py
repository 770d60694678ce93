"""Limits of the set-up that enter the uncertainty (plane, tilt, temperature), with defaults for those not stated."""

from collections.abc import Mapping

from calib.limits import Limits

# Residual distortion of a calibrated lens, relative to the radius at the corner (as the rows and columns of a board
# show).
LENS_LEFT = 0.0002


def limits_from(stated: Mapping[str, float | None], *, lens_calibrated: bool) -> tuple[Limits, frozenset[str]]:
    """Return the limits of the set-up, and the names of those that the user stated.

    Parameters
    ----------
    stated : mapping of str to float or None
        Limits by their names in `calib.Limits`; None for a limit that is not stated.
    lens_calibrated : bool
        Whether the distortion of the lens is corrected, so that the residual distortion is smaller.
    """
    given = {name: value for name, value in stated.items() if value is not None}
    defaults = {"lens_relative": LENS_LEFT} if lens_calibrated else {}
    return Limits(**(defaults | given)), frozenset(given)


__all__ = ["LENS_LEFT", "limits_from"]
