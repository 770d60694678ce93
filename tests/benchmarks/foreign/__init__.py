"""Drawn tables of other programs with known truth, and a user who obeys each advice of the reader."""
