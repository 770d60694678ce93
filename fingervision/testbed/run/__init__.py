"""Execution of a recipe on a bed: planned, checked, monitored during motion, recorded."""
