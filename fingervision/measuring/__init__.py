"""Measure recordings: the gap over time, its uncertainty, and pictures of the measurement."""
