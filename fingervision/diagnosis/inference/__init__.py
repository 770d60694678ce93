"""Inference: hypothesis fits, significance, ambiguity set and model adequacy, which lead to the verdict."""
