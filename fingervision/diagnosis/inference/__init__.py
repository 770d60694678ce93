"""From a whitened residual to a verdict: hypothesis fits, significance, ambiguity set, model adequacy."""
