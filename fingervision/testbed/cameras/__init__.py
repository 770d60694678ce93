"""Kinds of cameras for the test bed, one per module, each with `KEYS` and `build(section, context)`."""
