"""Limits of a measurement with the present set-up: one finding per module, with its cost in µm and its remedy."""
