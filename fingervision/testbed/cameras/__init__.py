"""Cameras of the bed, one per file: a module with `KEYS` and `build(section, context)` is a kind."""
