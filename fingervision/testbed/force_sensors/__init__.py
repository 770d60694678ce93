"""Kinds of force sensors, one per module, each with `KEYS` and `build(section, context)`."""
