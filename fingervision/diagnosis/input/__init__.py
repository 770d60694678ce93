"""The recorded input: smoothing, encoder, and path of the stage between the readings."""
