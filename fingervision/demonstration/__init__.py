"""The whole procedure on the simulated bed, from a hidden effect to the report that names it."""
