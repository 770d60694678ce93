"""Kinds of actuators, one per module, each with `KEYS` and `build(section, context)`."""
