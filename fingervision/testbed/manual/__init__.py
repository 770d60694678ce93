"""Motions that a person requests one by one, and sequences of step data."""
