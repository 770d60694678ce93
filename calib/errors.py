"""The error that a user reads: one sentence that says what, what it must be, what it is, and what to do."""


class CalibrationError(ValueError):
    """The scene cannot be calibrated or measured, for a reason that the message states in a sentence."""
