"""Force sensors, one a file: a module with `KEYS` and `build(section, context)` is a kind."""
