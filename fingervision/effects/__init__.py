"""Physical effects, one a file, named as in the catalogue."""
