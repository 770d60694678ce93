"""What limits the measurement on this bench: one finding a file, each with its cost in micrometres and its remedy."""
