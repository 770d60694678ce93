"""Adapters to the software of laboratories, one a file; each needs a library of its own, which is an extra."""
