"""Compare the live measurement with a model: prediction, residual, and a first verdict."""
