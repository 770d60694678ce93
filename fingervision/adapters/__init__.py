"""Adapters to laboratory software, one per module; each needs a library that is an optional extra."""
