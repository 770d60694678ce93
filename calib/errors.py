"""Error for users: one sentence with the subject, the requirement, the actual value, and what to do."""


class CalibrationError(ValueError):
    """The scene cannot be calibrated or measured; the message states the reason in one sentence."""
