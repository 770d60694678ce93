"""Compare simulation and measurement: where they disagree, which effect explains it, and what remains unexplained."""
