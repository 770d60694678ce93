"""Adapters to laboratory software, one per module. Each adapter needs a library that is an optional extra."""
