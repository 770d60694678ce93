"""Motion of a stage: its profile, its limits, and its position between the steps of its encoder."""
