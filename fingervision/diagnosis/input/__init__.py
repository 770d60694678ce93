"""The recorded input: smoothing, encoder, and the stage's path between the readings."""
