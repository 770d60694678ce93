"""The measurement held against a model while it is made: prediction, residual, and a first verdict."""
