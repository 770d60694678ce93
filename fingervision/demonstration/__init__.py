"""Demonstration of the complete procedure on the simulated test bed, from an added effect to its diagnosis."""
