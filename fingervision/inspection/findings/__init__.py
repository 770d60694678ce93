"""Findings, one limit of a set-up per module; each module has `find(sample) -> Finding`.

A new finding is added by a new module, which `inspection.catalogue` collects.
"""
