"""Diagnose a mechanism from the poses of its bodies: which body or hinge differs from the drawing."""
