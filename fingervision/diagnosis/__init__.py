"""Compare simulation and measurement: where they disagree, which effect explains the disagreement, and what remains."""
