"""Compare simulation and measurement: where they disagree, which effect is missing, and what remains."""
