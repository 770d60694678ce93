"""Adapters to the software of laboratories, one per file; each needs its own library, which is an optional extra."""
