"""Error for users: one sentence with the subject, the requirement, the actual value, and what to do."""


class CalibrationError(ValueError):
    """The scene cannot be calibrated or measured; the message states the reason in one sentence.

    Examples
    --------
    >>> import calib
    >>> try:
    ...     calib.Board(2, 2, square_mm=2.0, u_square_mm=0.0)
    ... except calib.CalibrationError as error:
    ...     print(error)
    A board must have at least 3x3 corners, but 2x2 is stated.
    """
