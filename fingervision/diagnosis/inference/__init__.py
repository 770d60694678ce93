"""Inference: hypothesis fits, posterior odds, ambiguity set and model adequacy, which lead to the verdict."""
