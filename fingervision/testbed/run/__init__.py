"""Execution of a recipe on a test bed: planned, checked, monitored during motion, recorded."""
