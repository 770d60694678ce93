"""Limits of the set-up that enter the uncertainty (plane, tilt, temperature), with defaults for those not stated."""

from collections.abc import Mapping

from calib.limits import Limits

# With a calibrated lens this part of the radius at the corner is left to bend (a board's rows and columns show it).
LENS_LEFT = 0.0002


def limits_from(stated: Mapping[str, float | None], *, lens_calibrated: bool) -> tuple[Limits, frozenset[str]]:
    """Return the limits of the set-up, and the names of those that the user stated.

    Parameters
    ----------
    stated : mapping of str to float or None
        By the names of `calib.Limits`; None where not stated.
    lens_calibrated : bool
        Whether a lens is taken off: what is then left is less.
    """
    given = {name: value for name, value in stated.items() if value is not None}
    defaults = {"lens_relative": LENS_LEFT} if lens_calibrated else {}
    return Limits(**(defaults | given)), frozenset(given)


__all__ = ["LENS_LEFT", "limits_from"]
