"""Motions that a person asks for one by one, and sequences of step data."""
