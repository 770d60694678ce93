"""Gauges of one's own: named things that are measured in every frame, each kind in a file of `kinds`."""
