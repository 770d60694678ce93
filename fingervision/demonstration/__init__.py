"""Demonstration of the complete procedure on the simulated test bed, from a hidden effect to its diagnosis."""
