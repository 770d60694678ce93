"""A recipe on a bed: planned, checked, watched while it moves, recorded."""
