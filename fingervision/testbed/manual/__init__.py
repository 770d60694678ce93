"""Motions that a person requests individually, and sequences of step data."""
