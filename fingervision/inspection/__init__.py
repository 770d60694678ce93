"""What limits the measurement with this set-up: one finding per file, with its cost in micrometres and its remedy."""
